#pragma once

#include "server/denoise/frame.h"

namespace relume::denoise {

// Numbers that Open Image Denoise's networks see for radiances: a curve that follows how people
// tell brightnesses apart (Mantiuk's PU), 1 at 65504. What is below black counts as black.
float ToPu(float radiance);
float FromPu(float y);

// sRGB's curve, for albedo.
float ToSrgb(float linear);
float FromSrgb(float y);

// What an image is to be multiplied by before the curve, so that bright and dark ones look alike:
// 0.18 over the geometric mean of the luminances of blocks of at most 16x16 pixels, black ones left
// out. 1 if all are black.
float AutoExposure(const Plane (&color)[3], int width, int height);

}  // namespace relume::denoise

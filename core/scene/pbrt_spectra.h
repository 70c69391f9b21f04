#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/math/vec.h"
#include "core/scene/pbrt_params.h"

namespace relume::pbrt {

// What a spectrum stands for decides how it becomes linear Rec. 709:
//   reflectance  as seen under D65; 1 everywhere is white
//   light        pbrt-v4: brought to luminance 1, as its lights are; pbrt-v3: as it is, over the
//                integral of the luminosity function, and blackbodies to a peak of 1
//   index        of refraction, or absorption: weighted means under the three primaries' curves
enum class SpectrumUse { kReflectance, kLight, kIndex };

// Reads spectra: rgb, xyz, blackbody, names that pbrt-v4 knows, samples, and files of samples
// ("wavelength value" in nm). All are reduced to three numbers: Relume renders in RGB.
class Spectra {
  public:
    Spectra(const FileSource& files, bool version3, Notes* notes)
        : files_(files), version3_(version3), notes_(notes) {}

    // The parameter's colour; null if it is absent or a texture. One number (float) is grey.
    std::optional<Rgb> Find(const Params& params, std::string_view name, SpectrumUse use);
    Rgb Get(const Params& params, std::string_view name, SpectrumUse use, Rgb otherwise);

    // Files that were read, in order.
    const std::vector<std::string>& names() const { return names_; }

  private:
    Rgb Reduce(const Param& param, SpectrumUse use);
    Rgb Named(const std::string& name, const Param& param, SpectrumUse use);
    std::vector<float> ReadFile(const std::string& path, const Place& place);

    const FileSource& files_;
    bool version3_;
    Notes* notes_;
    std::vector<std::string> names_;
};

// Samples are pairs of wavelength (nm, rising) and value, linear in between and constant beyond.
Rgb SamplesToRgb(const std::vector<float>& samples, SpectrumUse use, bool version3,
                 const Place& place);
// Of a temperature in kelvin, luminance 1.
Rgb BlackbodyToRgb(float kelvin);

// Index of refraction and absorption of what pbrt-v4 names "metal-X-eta" and "metal-X-k", or
// "glass-X"; null if unknown.
std::optional<Rgb> NamedIndex(std::string_view name);
// Colour of luminance 1 of a standard illuminant ("stdillum-A"); null if unknown.
std::optional<Rgb> NamedIlluminant(std::string_view name);

Rgb XyzToRgb(Vec3f xyz);  // may be negative

}  // namespace relume::pbrt

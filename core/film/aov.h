#pragma once

#include <array>
#include <string>
#include <vector>

namespace relume {

// Features that every sample carries beside its radiance (methods: first hit behind perfect
// specular bounces; a miss writes normal 0, albedo the environment's colour clamped to 1, and the
// distance to the far side of the scene's bounding sphere).
enum FeatureChannel : int {
    kAlbedoR,
    kAlbedoG,
    kAlbedoB,  // reflectance of the surface, times the throughput of skipped bounces
    kNormalX,
    kNormalY,
    kNormalZ,     // shading normal, world space, facing the camera, unit length
    kDepth,       // length of the path from the camera, scene units
    kVisibility,  // 1 if the shadow ray of the first hit reached its light, else 0
    kFeatureCount,
};

// "albedo.R", "N.X", "Z", "visibility.Y": the names in EXR files.
const char* FeatureName(int feature);

// Planes of the film, and of a tile on the wire: 40 floats a pixel. Half a holds samples of even
// global index, half b of odd (each half drawn from its own scramble).
enum FilmChannel : int {
    kCountA,
    kCountB,        // finite samples in the half
    kBadCount,      // samples dropped for a NaN or an infinity
    kMaxLuminance,  // brightest sample, directly seen emission left out
    kMeanA,
    kMeanB = kMeanA + 3,  // radiance RGB, mean
    kM2A = kMeanB + 3,
    kM2B = kM2A + 3,           // radiance RGB, sum of squared deviations
    kFeatureMeanA = kM2B + 3,  // + FeatureChannel
    kFeatureMeanB = kFeatureMeanA + kFeatureCount,
    kFeatureM2 = kFeatureMeanB + kFeatureCount,  // both halves together
    kFilmChannelCount = kFeatureM2 + kFeatureCount,
};

// "n_a", "mean_a.R", "feature_m2.Z": the channel list that is declared on the wire, in order.
const std::vector<std::string>& FilmChannelNames();

}  // namespace relume

#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/sample_store.h"

namespace relume::bench {

// A view of a scene, and where its samples are kept, as studies take it on their command lines.
struct StudyScene {
    std::string scene, environment, store, name;
    float environment_scale = 1, time = -1, shutter = -1;
    std::string size = "192x144";
    std::vector<float> look_from, look_at{0, 0, 0};
    float fov = 40;
    int depth = 0, threads = 2, seeds = 4;
    std::uint32_t stored = 512;
};

void AddSceneOptions(CLI::App* app, StudyScene* options);

// The samples of each seed, from 0 on: from the store, or rendered and put there. What is stored is
// asked for first: the scene is loaded only if something lacks.
std::vector<SampleStore> LoadSamples(const StudyScene& options);

}  // namespace relume::bench

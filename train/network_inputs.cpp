// relume-network-inputs: what the network of `net` sees of a frame, and the candidates that it
// mixes, for training. One line of JSON (width, height, inputs, candidates, reference, spp), then
// float32 planes, little-endian, row-major: the inputs, R G B of each candidate, and of the
// reference if one is given, then the extras: what other networks see beside these, variances of
// the pixel's mean (colour, albedo, normal: mean of the channels; depth relative to the largest)
// and that depth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/image/exr.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/frame.h"
#include "server/denoise/halves.h"
#include "server/denoise/net_inputs.h"

namespace {

using namespace relume;
using namespace relume::denoise;

struct Options {
    std::string input, reference, output;
    std::vector<std::string> candidates;
    int threads = 0;
    int half = -1;  // -1: the whole frame
};

std::vector<std::pair<std::string, Plane>> Extras(const Frame& frame) {
    const std::size_t size = frame.pixel_count();
    const auto variance = [&](int first, int count, float scale) {
        Plane plane(size, 0.0f);
        for (int f = first; f < first + count && !frame.feature_variance[f].empty(); ++f) {
            for (std::size_t i = 0; i < size; ++i) {
                const float n = frame.count.empty() ? 1.0f : std::max(frame.count[i], 1.0f);
                plane[i] += scale * frame.feature_variance[f][i] / (n * static_cast<float>(count));
            }
        }
        return plane;
    };
    Plane color(size), depth = frame.feature[kDepth];
    for (std::size_t i = 0; i < size; ++i) {
        color[i] = (frame.variance[0][i] + frame.variance[1][i] + frame.variance[2][i]) / 3;
    }
    depth.resize(size);
    const float largest = size > 0 ? *std::ranges::max_element(depth) : 0.0f;
    const float scale = largest > 0 ? 1 / largest : 0.0f;
    for (float& d : depth) {
        d *= scale;
    }
    return {{"color_variance", std::move(color)},
            {"albedo_variance", variance(kAlbedoR, 3, 1)},
            {"normal_variance", variance(kNormalX, 3, 1)},
            {"depth", std::move(depth)},
            {"depth_variance", variance(kDepth, 1, scale * scale)}};
}

void Write(const Options& options) {
    Frame frame = FrameFromImage(ReadExr(options.input), nullptr);
    if (options.half >= 0) {
        frame = HalfFrame(frame, options.half);
    }
    NetCandidates candidates{};
    std::map<std::size_t, Result> results;
    nlohmann::json names = nlohmann::json::array();
    for (std::size_t k = 0; k < kNetSlotCount; ++k) {
        const std::string name = kNetSlots[k].name;
        if (k > 1 && std::ranges::find(options.candidates, name) == options.candidates.end()) {
            continue;
        }
        results[k] = RunDenoiser(*MakeDenoiser(kNetSlots[k].filter), frame, {});
        candidates[k] = &results[k];
        names.push_back(name);
    }
    double samples = 0;
    for (const float count : frame.count) {
        samples += count;
    }
    const std::vector<std::pair<std::string, Plane>> extras = Extras(frame);
    nlohmann::json extra_names = nlohmann::json::array();
    for (const auto& [name, plane] : extras) {
        extra_names.push_back(name);
    }
    const nlohmann::json header = {
        {"extras", extra_names},
        {"width", frame.width},
        {"height", frame.height},
        {"inputs", NetInputNames()},
        {"candidates", names},
        {"reference", !options.reference.empty()},
        {"spp", samples / static_cast<double>(std::max<std::size_t>(frame.pixel_count(), 1))}};
    std::ofstream out(options.output, std::ios::binary);
    out << header.dump() << "\n";
    const auto write = [&out](std::span<const float> plane) {
        out.write(reinterpret_cast<const char*>(plane.data()),
                  static_cast<std::streamsize>(plane.size_bytes()));
    };
    for (const Plane& plane : MakeNetInputs(frame, candidates)) {
        write(plane);
    }
    for (const auto& [k, result] : results) {
        for (const Plane& plane : result.color) {
            write(plane);
        }
    }
    if (!options.reference.empty()) {
        const Image reference = ReadExr(options.reference);
        if (reference.width() != frame.width || reference.height() != frame.height) {
            ThrowInvalidArgument(fmt::format(
                "{}: {}x{} pixels, but {} has {}x{}", options.reference, reference.width(),
                reference.height(), options.input, frame.width, frame.height));
        }
        for (const char* channel : {"R", "G", "B"}) {
            write(reference.Plane(channel));
        }
    }
    for (const auto& [name, plane] : extras) {
        write(plane);
    }
    if (!out.flush()) {
        ThrowInvalidArgument(options.output + ": can't be written");
    }
}

}  // namespace

int main(int argc, char** argv) {
    CLI::App app("Inputs and candidates of the network of filter `net`, for training");
    Options options;
    app.add_option("NOISY", options.input, "EXR with all layers")->required();
    app.add_option("--reference", options.reference, "EXR of the same picture, many samples");
    app.add_option("-o", options.output, "file to write")->required();
    options.candidates = {"rd", "nfor", "oidn"};
    app.add_option("--candidates", options.candidates, "beside none and bilateral")
        ->delimiter(',')
        ->capture_default_str();
    app.add_option("--half", options.half,
                   "of the samples alone, 0 or 1: filters are tried on them")
        ->check(CLI::Range(0, 1));
    app.add_option("--threads", options.threads, "0: all");
    CLI11_PARSE(app, argc, argv);
    try {
        SetThreadCount(options.threads);
        Write(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "relume-network-inputs: {}\n", error.what());
        return 1;
    }
    return 0;
}

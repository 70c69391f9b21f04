#include "core/scene/gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace relume::gltf {
namespace {

using Path = Animations::Path;

constexpr float kHiddenScale = 1e-6f;

std::optional<Path> PathOf(const std::string& name) {
    constexpr std::pair<const char*, Path> kPaths[] = {{"translation", Path::kTranslation},
                                                       {"rotation", Path::kRotation},
                                                       {"scale", Path::kScale},
                                                       {"weights", Path::kWeights}};
    for (const auto& [known, path] : kPaths) {
        if (name == known) {
            return path;
        }
    }
    return std::nullopt;
}

void NormalizeQuaternion(std::vector<float>* q) {
    float length = 0;
    for (const float v : *q) {
        length += v * v;
    }
    length = std::sqrt(length);
    for (float& v : *q) {
        v /= length;
    }
}

// Along the shorter way (appendix C.4).
std::vector<float> Slerp(const float* a, const float* b, float u) {
    float dot = 0;
    for (int i = 0; i < 4; ++i) {
        dot += a[i] * b[i];
    }
    const float angle = std::acos(std::min(std::abs(dot), 1.0f)), sine = std::sin(angle);
    float wa = 1 - u, wb = u;
    if (sine > 1e-4f) {
        wa = std::sin(angle * (1 - u)) / sine;
        wb = std::sin(angle * u) / sine;
    }
    std::vector<float> q(4);
    for (int i = 0; i < 4; ++i) {
        q[static_cast<std::size_t>(i)] = wa * a[i] + (dot < 0 ? -wb : wb) * b[i];
    }
    return q;
}

}  // namespace

Animations::Animations(const Document& document, const Data& data, Notes* notes) {
    for (std::size_t a = 0; a < document.model.animations.size(); ++a) {
        const tinygltf::Animation& animation = document.model.animations[a];
        for (std::size_t c = 0; c < animation.channels.size(); ++c) {
            const tinygltf::AnimationChannel& channel = animation.channels[c];
            const SourceLocation place =
                fmt::format("{}, channel {}", document.Place("animation", a, animation.name), c);
            relume::gltf::At(document.model.nodes, channel.target_node, place, "node");
            const std::optional<Path> path = PathOf(channel.target_path);
            if (!path) {
                notes->Add(fmt::format("animations of '{}' are ignored", channel.target_path));
                continue;
            }
            if (channels_.count({channel.target_node, *path}) != 0) {
                notes->Add(fmt::format("{}: ignored, since another animates the {} of node {} too",
                                       place, channel.target_path, channel.target_node));
                continue;
            }
            const tinygltf::AnimationSampler& sampler =
                relume::gltf::At(animation.samplers, channel.sampler, place, "sampler");
            Channel read = ReadChannel(data, sampler, *path, place);
            end_ = std::max(end_, static_cast<double>(read.times.back()));
            channels_[{channel.target_node, *path}] = std::move(read);
        }
    }
}

Animations::Channel Animations::ReadChannel(const Data& data,
                                            const tinygltf::AnimationSampler& sampler, Path path,
                                            const SourceLocation& place) {
    Channel channel;
    if (sampler.interpolation == "STEP") {
        channel.interpolation = Interpolation::kStep;
    } else if (sampler.interpolation == "CUBICSPLINE") {
        channel.interpolation = Interpolation::kCubic;
    } else if (sampler.interpolation != "LINEAR") {
        Fail(place, fmt::format("its interpolation '{}' is not known (LINEAR, STEP, CUBICSPLINE); "
                                "export the scene again",
                                sampler.interpolation));
    }
    channel.times = data.Floats(sampler.input, 1, place + ": input");
    const std::vector<float>& times = channel.times;
    if (times.empty()) {
        Fail(place, "has no keys; export the scene again");
    }
    for (std::size_t i = 0; i < times.size(); ++i) {
        if (!std::isfinite(times[i]) || (i > 0 && !(times[i] > times[i - 1]))) {
            Fail(place,
                 fmt::format("the time of key {} is {}; times must be finite and rise: export "
                             "the scene again",
                             i, times[i]));
        }
    }
    const int components = path == Path::kRotation ? 4 : path == Path::kWeights ? 1 : 3;
    channel.values = data.Floats(sampler.output, components, place + ": output");
    const std::size_t parts =
        times.size() * (channel.interpolation == Interpolation::kCubic ? 3 : 1);
    channel.components = channel.values.size() / parts;
    if (channel.values.empty() || channel.values.size() % parts != 0 ||
        (path != Path::kWeights && channel.components != static_cast<std::size_t>(components))) {
        Fail(place,
             fmt::format("has {} keys and {} numbers as their values; export the scene again",
                         times.size(), channel.values.size()));
    }
    for (const float value : channel.values) {
        if (!std::isfinite(value)) {
            Fail(place, "a value is not finite (NaN or infinity); repair the animation");
        }
    }
    return channel;
}

bool Animations::MovesNode(int node) const {
    return channels_.count({node, Path::kTranslation}) + channels_.count({node, Path::kRotation}) +
               channels_.count({node, Path::kScale}) >
           0;
}

std::vector<float> Animations::At(int node, Path path, double seconds) const {
    const auto found = channels_.find({node, path});
    if (found == channels_.end()) {
        return {};
    }
    const Channel& channel = found->second;
    const std::vector<float>& times = channel.times;
    const bool cubic = channel.interpolation == Interpolation::kCubic;
    // Part 0 to 2: in-tangent, value, out-tangent.
    const auto part = [&](std::size_t key, std::size_t which) {
        return &channel.values[(cubic ? 3 * key + which : key) * channel.components];
    };
    // The segment that the time lies in, and where.
    const std::size_t after = static_cast<std::size_t>(
        std::upper_bound(times.begin(), times.end(), seconds) - times.begin());
    const std::size_t a = after == 0 ? 0 : after - 1, b = std::min(after, times.size() - 1);
    const float length = times[b] - times[a];
    const float u =
        a == b ? 0 : static_cast<float>((seconds - static_cast<double>(times[a])) / length);

    std::vector<float> value(part(a, 1), part(a, 1) + channel.components);
    if (a != b && channel.interpolation == Interpolation::kLinear) {
        if (path == Path::kRotation) {
            value = Slerp(part(a, 1), part(b, 1), u);
        } else {
            for (std::size_t i = 0; i < value.size(); ++i) {
                value[i] += (part(b, 1)[i] - value[i]) * u;
            }
        }
    } else if (a != b && cubic) {  // Hermite (appendix C.5)
        const float u2 = u * u, u3 = u2 * u;
        for (std::size_t i = 0; i < value.size(); ++i) {
            value[i] = (2 * u3 - 3 * u2 + 1) * value[i] +
                       (u3 - 2 * u2 + u) * length * part(a, 2)[i] +
                       (3 * u2 - 2 * u3) * part(b, 1)[i] + (u3 - u2) * length * part(b, 0)[i];
        }
    }
    if (path == Path::kRotation) {
        NormalizeQuaternion(&value);
    } else if (path == Path::kScale) {
        for (float& scale : value) {
            scale = scale == 0 ? kHiddenScale : scale;
        }
    }
    return value;
}

}  // namespace relume::gltf

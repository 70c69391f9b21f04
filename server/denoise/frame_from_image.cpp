#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "server/denoise/channel_names.h"
#include "server/denoise/frame.h"
#include "server/denoise/frame_repair.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

// Depths beyond are how renderers write a miss (Cycles: 1e10; others infinity).
constexpr float kFarthestDepth = 1e9f;

class Reader {
  public:
    Reader(const Image& image, Frame* frame, std::vector<std::string>* notes)
        : image_(image), frame_(*frame), notes_(notes) {}

    void Read();

  private:
    void Note(const std::string& text) {
        if (notes_ != nullptr) {
            notes_->push_back(text);
        }
    }
    Plane Copy(int channel) const {
        const auto from = image_.Plane(channel);
        return {from.begin(), from.end()};
    }
    // Copies a group; what is not finite, or negative where that can't be, gets its neighbours'.
    void CopyRepaired(const ChannelGroup& group, bool is_variance, Plane* to) const;

    void ReadCount();
    void ReadBrightest();
    void ReadColor();
    void ReadHalves();
    void ReadVariance();
    void ReadFeature(Quantity quantity, int first, const char* name);
    void CapDepth();

    const Image& image_;
    Frame& frame_;
    std::vector<std::string>* notes_;
};

void Reader::CopyRepaired(const ChannelGroup& group, bool is_variance, Plane* to) const {
    for (std::size_t k = 0; k < group.size(); ++k) {
        to[k] = Copy(group[k]);
        Holes holes = frame_.flagged;
        for (std::size_t i = 0; i < holes.size(); ++i) {
            holes[i] |= !IsUsable(to[k][i]) || (is_variance && to[k][i] < 0);
        }
        std::vector<Plane*> plane = {&to[k]};
        FillHoles(frame_.width, frame_.height, holes, is_variance ? std::vector<Plane*>{} : plane,
                  is_variance ? plane : std::vector<Plane*>{});
    }
}

void Reader::Read() {
    frame_.width = image_.width();
    frame_.height = image_.height();
    frame_.flagged.assign(frame_.pixel_count(), 0);
    ReadCount();
    ReadColor();
    ReadBrightest();
    ReadHalves();
    ReadVariance();
    ReadFeature(Quantity::kAlbedo, kAlbedoR, "albedo");
    ReadFeature(Quantity::kNormal, kNormalX, "normal");
    CapDepth();
    ReadFeature(Quantity::kVisibility, kVisibility, nullptr);
    const bool uses_count = !frame_.feature_variance[kAlbedoR].empty() ||
                            !frame_.feature_variance[kNormalX].empty() ||
                            !frame_.feature_variance[kDepth].empty();
    if (frame_.count.empty() && uses_count) {
        Note(
            "samples a pixel: not in the file; features' variances are taken for those of one "
            "sample");
    }
}

void Reader::ReadCount() {
    const auto group = FindChannels(image_, Quantity::kCount);
    if (!group) {
        return;
    }
    frame_.count = Copy((*group)[0]);
    for (std::size_t i = 0; i < frame_.count.size(); ++i) {
        float& n = frame_.count[i];
        n = IsUsable(n) ? std::max(n, 0.0f) : 0.0f;
        frame_.flagged[i] = n == 0;
    }
}

void Reader::ReadBrightest() {
    if (const auto group = FindChannels(image_, Quantity::kBrightest)) {
        CopyRepaired(*group, true, &frame_.brightest);
    }
}

void Reader::ReadColor() {
    const auto group = FindChannels(image_, Quantity::kColor);
    if (!group) {
        ThrowInvalidArgument(fmt::format(
            "no colour to filter: R, G, B (or noisy.*, Combined.*, beauty.*, rgba.*, color.*) are "
            "not among the channels {}",
            fmt::join(image_.channels(), ", ")));
    }
    if (image_.Find("R") >= 0 && (*group)[0] != image_.Find("R")) {
        Note("filters " + NamesOf(image_, *group));
    }
    std::size_t bad = 0;
    for (int c = 0; c < 3; ++c) {
        frame_.color[c] = Copy((*group)[static_cast<std::size_t>(c)]);
    }
    for (std::size_t i = 0; i < frame_.flagged.size(); ++i) {
        const bool usable = IsUsable(frame_.color[0][i]) && IsUsable(frame_.color[1][i]) &&
                            IsUsable(frame_.color[2][i]);
        bad += usable ? 0 : 1;
        frame_.flagged[i] |= !usable;
    }
    if (bad > 0) {
        Note(fmt::format("{} pixel{} without a finite colour take{} the neighbours' mean", bad,
                         bad > 1 ? "s" : "", bad > 1 ? "" : "s"));
    }
    FillHoles(frame_.width, frame_.height, frame_.flagged,
              {&frame_.color[0], &frame_.color[1], &frame_.color[2]}, {});
}

void Reader::ReadHalves() {
    const auto a = FindChannels(image_, Quantity::kHalfA);
    const auto b = FindChannels(image_, Quantity::kHalfB);
    if (a && b) {
        CopyRepaired(*a, false, frame_.half[0]);
        CopyRepaired(*b, false, frame_.half[1]);
    }
}

void Reader::ReadVariance() {
    const int width = frame_.width, height = frame_.height;
    const auto mean = FindChannels(image_, Quantity::kMeanVariance);
    const auto sample = FindChannels(image_, Quantity::kSampleVariance);
    if (mean) {
        CopyRepaired(*mean, true, frame_.variance);
    } else if (sample && !frame_.count.empty()) {
        CopyRepaired(*sample, true, frame_.variance);
        for (Plane& plane : frame_.variance) {
            for (std::size_t i = 0; i < plane.size(); ++i) {
                plane[i] /= std::max(frame_.count[i], 1.0f);
            }
        }
        Note("variance: " + NamesOf(image_, *sample) + ", of one sample, over the sample count");
    } else if (frame_.has_halves()) {
        const Plane inside = SumBox(Plane(frame_.pixel_count(), 1.0f), width, height, 2);
        for (int c = 0; c < 3; ++c) {
            Plane squared(frame_.pixel_count());
            for (std::size_t i = 0; i < squared.size(); ++i) {
                const float delta = frame_.half[0][c][i] - frame_.half[1][c][i];
                squared[i] = 0.25f * delta * delta;
            }
            frame_.variance[c] = SumBox(squared, width, height, 2);
            for (std::size_t i = 0; i < squared.size(); ++i) {
                frame_.variance[c][i] /= inside[i];
            }
        }
        Note(
            "variance: none in the file; from the difference of buffer_a and buffer_b over 5x5 "
            "pixels");
    } else {
        for (int c = 0; c < 3; ++c) {
            frame_.variance[c] = LocalDifferenceVariance(width, height, frame_.color[c]);
        }
        Note(
            "variance: none in the file; from the differences of neighbouring pixels over 5x5, "
            "which takes texture for noise");
    }
    for (int c = 0; c < 3; ++c) {
        frame_.sample_variance[c] = frame_.variance[c];
    }
}

// `name` null: not missed if it is not there.
void Reader::ReadFeature(Quantity quantity, int first, const char* name) {
    const auto group = FindChannels(image_, quantity);
    if (!group) {
        if (name != nullptr) {
            Note(fmt::format("{}: none in the file; filtered without it", name));
        }
        return;
    }
    CopyRepaired(*group, false, frame_.feature + first);
    if (const auto variance = FindSuffixed(image_, *group, "_variance")) {
        CopyRepaired(*variance, true, frame_.feature_variance + first);
        for (std::size_t k = 0; k < group->size() && !frame_.count.empty(); ++k) {
            Plane& plane = frame_.feature_variance[static_cast<std::size_t>(first) + k];
            for (std::size_t i = 0; i < plane.size(); ++i) {
                plane[i] *= std::max(frame_.count[i], 1.0f);
            }
        }
    }
    const auto a = FindSuffixed(image_, *group, "_a"), b = FindSuffixed(image_, *group, "_b");
    if (a && b) {
        CopyRepaired(*a, false, frame_.feature_half[0] + first);
        CopyRepaired(*b, false, frame_.feature_half[1] + first);
    }
}

// A miss lies as far as the farthest hit.
void Reader::CapDepth() {
    const auto group = FindChannels(image_, Quantity::kDepth);
    if (!group) {
        ReadFeature(Quantity::kDepth, kDepth, "depth");
        return;
    }
    Plane raw = Copy((*group)[0]);
    float farthest = 0;
    for (const float z : raw) {
        if (std::abs(z) < kFarthestDepth) {
            farthest = std::max(farthest, z);
        }
    }
    ReadFeature(Quantity::kDepth, kDepth, "depth");
    for (std::size_t i = 0; i < raw.size(); ++i) {
        // Pixels whose hole was filled from misses hold large values too.
        if (raw[i] >= kFarthestDepth || frame_.feature[kDepth][i] > farthest) {
            frame_.feature[kDepth][i] = farthest;
        }
    }
}

}  // namespace

Frame FrameFromImage(const Image& image, std::vector<std::string>* notes) {
    if (image.pixel_count() == 0) {
        ThrowInvalidArgument("the image has no pixels");
    }
    Frame frame;
    frame.sampling = ReadSampling(image.metadata());
    Reader(image, &frame, notes).Read();
    return frame;
}

}  // namespace relume::denoise

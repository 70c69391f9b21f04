// A small network that says for each pixel how much of each of some filters' images is in its
// result ("Ours with CNN" of Xing, Chen, Li 2020, section 3.4, whose network says parameters of the
// filter instead; docs/networks.md has more).
//
// A U-Net (Ronneberger et al. 2015) sees the candidates, what they say of their errors, how far
// they are from the noisy image over its noise, and the features (net_inputs.h). Its outputs are
// weights by softmax: the result lies between the candidates, one of which is the noisy image.
//
//   mode                corrected (default), or printed: net_printed.cpp
//   candidates          corrected only: beside the noisy image and bilateral:mode=robust, which are
//                       always there, of rd, nfor and oidn, joined by '-'; "none": none. Default:
//                       rd-nfor, and oidn if its weights are there
//   bilateral-without   corrected only: features that the bilateral filter is not to look at, as
//                       `without`
//   oidn-features       corrected only: prefiltered (default), or noisy, oidn's `features`: a third
//                       of its time
//
// The estimated error is the weighted mean of the candidates' own, an upper bound where they are
// right (Jensen); unset if oidn, which has none, is among them.
#include "server/denoise/net.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/net_evidence.h"
#include "server/denoise/net_printed.h"
#include "server/denoise/network/network.h"
#include "server/denoise/network/weights.h"
#include "server/denoise/oidn_library.h"
#include "server/denoise/oidn_networks.h"

namespace relume::denoise {
namespace {

constexpr const char* kWeights = "relume_blend";  // their name
constexpr std::size_t kPixels = 4096;             // a task
constexpr int kLeastForOidn = 16;                 // pixels a side

// train/model.py has the same.
GraphSpec Graph() {
    return {{
        Convolution("enc_conv0", "input"),
        Pool("pool1", "enc_conv0"),
        Convolution("enc_conv1", "pool1"),
        Pool("pool2", "enc_conv1"),
        Convolution("enc_conv2", "pool2"),
        Pool("pool3", "enc_conv2"),
        Convolution("enc_conv3", "pool3"),
        Upsample("up2", "enc_conv3"),
        Concatenate("join2", {"up2", "enc_conv2"}),
        Convolution("dec_conv2", "join2"),
        Upsample("up1", "dec_conv2"),
        Concatenate("join1", {"up1", "enc_conv1"}),
        Convolution("dec_conv1", "join1"),
        Upsample("up0", "dec_conv1"),
        Concatenate("join0", {"up0", "enc_conv0"}),
        Convolution("dec_conv0", "join0"),
        Convolution("out_conv", "dec_conv0", false),
    }};
}

const Network& TheNetwork() {
    static const Network network = [] {
        const auto weights = FindNetworkWeights(kWeights);
        if (!weights) {
            throw Error(
                ErrorCode::kFailedPrecondition,
                fmt::format("filter 'net': no weights '{}' in {}", kWeights, NetworkFolders()));
        }
        Network made(Graph(), weights->tensors, weights->source);
        if (made.input_channels() != static_cast<int>(NetInputNames().size()) ||
            made.output_channels() != static_cast<int>(kNetSlotCount)) {
            ThrowInvalidArgument(
                fmt::format("{}: a network of {} inputs and {} outputs; filter 'net' has {} and {}",
                            weights->source, made.input_channels(), made.output_channels(),
                            NetInputNames().size(), kNetSlotCount));
        }
        return made;
    }();
    return network;
}

// Softmax over the candidates that are there, in place.
void Normalise(const NetCandidates& candidates, std::array<Plane, kNetSlotCount>* logits) {
    ParallelFor(0, (*logits)[0].size(), kPixels, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            float most = -INFINITY, sum = 0;
            for (std::size_t k = 0; k < kNetSlotCount; ++k) {
                most = candidates[k] != nullptr ? std::max(most, (*logits)[k][i]) : most;
            }
            for (std::size_t k = 0; k < kNetSlotCount; ++k) {
                if (candidates[k] != nullptr) {
                    (*logits)[k][i] = std::exp((*logits)[k][i] - most);
                    sum += (*logits)[k][i];
                }
            }
            for (std::size_t k = 0; k < kNetSlotCount; ++k) {
                (*logits)[k][i] /= sum;
            }
        }
    });
    for (std::size_t k = 0; k < kNetSlotCount; ++k) {
        if (candidates[k] == nullptr) {
            (*logits)[k].clear();
        }
    }
}

class Net final : public Denoiser {
  public:
    explicit Net(NetSpec spec) : spec_(std::move(spec)) {
        for (std::size_t k = 0; k < kNetSlotCount; ++k) {
            if (spec_.parts[k]) {
                candidates_[k] = MakeDenoiser(spec_.FilterOf(k));
            }
        }
    }

    std::string Describe() const override { return NetName(spec_); }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        std::array<Result, kNetSlotCount> results;
        NetCandidates candidates{};
        Result out;
        for (std::size_t k = 0; k < kNetSlotCount; ++k) {
            if (candidates_[k] && !SuitsNetSlot(k, frame)) {
                out.notes["left_out"] = fmt::format("{}: the image is thinner than {} pixels",
                                                    kNetSlots[k].name, kLeastForOidn);
            } else if (candidates_[k]) {
                results[k] = RunDenoiser(*candidates_[k], frame, cancel);
                candidates[k] = &results[k];
            }
        }
        NetMix mix = MixByNetwork(frame, candidates, cancel);
        std::ranges::move(mix.color, std::begin(out.color));
        out.error.emplace(frame.pixel_count(), 0.0f);
        for (std::size_t k = 0; k < kNetSlotCount; ++k) {
            if (candidates[k] == nullptr) {
                continue;
            }
            double share = 0;
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                share += mix.weights[k][i];
            }
            out.notes[std::string("share.") + kNetSlots[k].name] = fmt::format(
                "{:.3f}",
                share / static_cast<double>(std::max<std::size_t>(1, frame.pixel_count())));
            if (!results[k].error) {
                out.error.reset();
            }
            for (std::size_t i = 0; out.error && i < frame.pixel_count(); ++i) {
                (*out.error)[i] += mix.weights[k][i] * (*results[k].error)[i];
            }
        }
        return out;
    }

  private:
    NetSpec spec_;
    std::array<std::unique_ptr<Denoiser>, kNetSlotCount> candidates_;
};

NetParts ParseParts(const std::string& text) {
    NetParts parts = {true, true};
    std::istringstream words(text == "none" ? "" : text);
    for (std::string word; std::getline(words, word, '-');) {
        std::size_t k = kBilateralSlot + 1;
        while (k < kNetSlotCount && word != kNetSlots[k].name) {
            ++k;
        }
        if (k == kNetSlotCount || parts[k]) {
            ThrowInvalidArgument(
                fmt::format("filter 'net': candidates={}: known are rd, nfor, oidn, each once, "
                            "joined by '-', and none",
                            text));
        }
        parts[k] = true;
    }
    return parts;
}

std::string JoinNames(const NetParts& parts) {
    std::string names;
    for (std::size_t k = kBilateralSlot + 1; k < kNetSlotCount; ++k) {
        if (parts[k]) {
            names += fmt::format("{}{}", names.empty() ? "" : "-", kNetSlots[k].name);
        }
    }
    return names.empty() ? "none" : names;
}

}  // namespace

bool HasNetSlot(std::size_t slot) {
    return slot != kOidnSlot || HasOidnLibrary() || HasOidnNetworks();
}

bool SuitsNetSlot(std::size_t slot, const Frame& frame) {
    return slot != kOidnSlot || std::min(frame.width, frame.height) >= kLeastForOidn;
}

std::string NetSpec::FilterOf(std::size_t slot) const {
    std::string filter = kNetSlots[slot].filter;
    if (slot == kBilateralSlot && !without.empty()) {
        filter += ",without=" + without;
    }
    if (slot == kOidnSlot && !prefilters_oidn) {
        filter += ",features=noisy";
    }
    return filter;
}

std::string NetName(const NetSpec& spec) {
    return fmt::format(
        "net:candidates={}{}{}{}", JoinNames(spec.parts),
        spec.without.empty() ? "" : ",bilateral-without=", spec.without,
        spec.parts[kOidnSlot] && !spec.prefilters_oidn ? ",oidn-features=noisy" : "");
}

NetMix MixByNetwork(const Frame& frame, const NetCandidates& candidates,
                    const CancelToken& cancel) {
    const std::vector<Plane> inputs = MakeNetInputs(frame, candidates);
    std::vector<const float*> rows;
    for (const Plane& plane : inputs) {
        rows.push_back(plane.data());
    }
    std::vector<Plane> logits = TheNetwork().Run(rows, frame.width, frame.height, cancel);
    NetMix mix;
    std::ranges::move(logits, mix.weights.begin());
    Normalise(candidates, &mix.weights);
    HoldToSamples(frame, candidates, &mix.weights);
    for (std::size_t c = 0; c < 3; ++c) {
        mix.color[c].assign(frame.pixel_count(), 0.0f);
        for (std::size_t k = 0; k < kNetSlotCount; ++k) {
            for (std::size_t i = 0; candidates[k] != nullptr && i < frame.pixel_count(); ++i) {
                mix.color[c][i] += mix.weights[k][i] * candidates[k]->color[c][i];
            }
        }
    }
    return mix;
}

std::unique_ptr<Denoiser> MakeNet(const ParamSet& params) {
    if (params.GetChoice("mode", "corrected", {"corrected", "printed"}) == "printed") {
        return MakePrintedNet();
    }
    NetParts all;
    for (std::size_t k = 0; k < kNetSlotCount; ++k) {
        all[k] = HasNetSlot(k);
    }
    NetSpec spec;
    spec.parts = ParseParts(params.GetString("candidates", JoinNames(all)));
    spec.without = params.GetString("bilateral-without", "");
    spec.prefilters_oidn =
        params.GetChoice("oidn-features", "prefiltered", {"prefiltered", "noisy"}) == "prefiltered";
    return std::make_unique<Net>(std::move(spec));
}

}  // namespace relume::denoise

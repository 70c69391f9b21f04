#include <fmt/format.h>

#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/denoise/denoiser.h"
#include "server/denoise/fireflies.h"
#include "server/denoise/noisy_part.h"
#include "server/denoise/on_changed_frame.h"
#include "server/denoise/restore_energy.h"
#include "server/denoise/seen_lights.h"
#include "server/denoise/without_features.h"

namespace relume::denoise {

std::unique_ptr<Denoiser> MakeAuto(const ParamSet& params);
std::unique_ptr<Denoiser> MakeNone(const ParamSet& params);
std::unique_ptr<Denoiser> MakeBlend(const ParamSet& params);
std::unique_ptr<Denoiser> MakeBilateral(const ParamSet& params);
std::unique_ptr<Denoiser> MakeGem(const ParamSet& params);
std::unique_ptr<Denoiser> MakeKpcn(const ParamSet& params);
std::unique_ptr<Denoiser> MakeNet(const ParamSet& params);
std::unique_ptr<Denoiser> MakeNfor(const ParamSet& params);
std::unique_ptr<Denoiser> MakeOidn(const ParamSet& params);
std::unique_ptr<Denoiser> MakeSbf(const ParamSet& params);
std::unique_ptr<Denoiser> MakeSbfGradient(const ParamSet& params);
std::unique_ptr<Denoiser> MakeNlm(const ParamSet& params);
std::unique_ptr<Denoiser> MakeRd(const ParamSet& params);
std::unique_ptr<Denoiser> MakeRpf(const ParamSet& params);
std::unique_ptr<Denoiser> MakeWlr(const ParamSet& params);

namespace {

// One entry a filter, and its prototype above; each is defined in the file of its name.
constexpr struct {
    const char* name;
    std::unique_ptr<Denoiser> (*make)(const ParamSet& params);
    const char* help;  // what it is, source; then a line a parameter: name=default, values, unit
} kDenoisers[] = {
    {"auto", MakeAuto,
     "of none, bilateral, rd, nfor and their blends the cheapest whose error, by held-out "
     "samples on\n"
     "             a part of the image, is within one standard error of the best; features that "
     "don't\n"
     "             help are dropped\n"
     "    effort=0         what it may cost, as a part of the time that the samples take "
     "typically; "
     "0: any;\n"
     "                     jobs have 0.6\n"
     "    seconds=0        what it may take, seconds; 0: any\n"},
    {"none", MakeNone, "the mean of the samples, unfiltered\n"},
    {"bilateral", MakeBilateral,
     "cross-bilateral filter on normal, albedo and depth; Xing, Chen, Li 2020\n"
     "    mode=robust      robust: per pixel the best of seven windows (sigma 1 to 8 pixels) by "
     "SURE, with\n"
     "                     and without a range term, mixed with the noisy image so that it "
     "converges "
     "to it;\n"
     "                     corrected: the seven alone, constants of Li, Wu, Chuang 2012;\n"
     "                     printed: the paper's equations to the letter\n"
     "    taylor=8         printed only: terms of the gradient weight's series, 0 to 64; 0 = exp "
     "itself\n"},
    {"blend", MakeBlend,
     "weighted mean of filters; what is far from their median is drawn to it\n"
     "    bilateral=1      weight of bilateral:mode=robust, 0 to 1000; 0: it does not run\n"
     "    rd=1             of rd\n"
     "    nfor=1           of nfor\n"
     "    bilateral-without=NAMES  features that bilateral is not to look at, as `without`\n"},
    {"gem", MakeGem,
     "each pixel's Gaussian where less noise still outweighs more blur; Rousselle, Knaus,\n"
     "             Zwicker 2011\n"
     "    gamma=0.2        above 0, at most 0.5; more keeps more of detail and noise\n"},
    {"kpcn", MakeKpcn,
     "kernels that a network predicts for each pixel, on radiance over albedo; Bako et al. 2017\n"
     "    size=lite        lite: windows of 13x13 pixels; full: the paper's, of 21x21, twelve "
     "times "
     "as dear,\n"
     "                     whose weights you have to train\n"},
    {"net", MakeNet,
     "what a network makes of other filters' images; Xing, Chen, Li 2020\n"
     "    mode=corrected   corrected: the weights of a mean of them, for each pixel; printed: the "
     "paper's, the\n"
     "                     parameters of a cross-bilateral filter for each pixel\n"
     "    candidates=NAMES corrected only: of rd, nfor, oidn, joined by '-', or none; default: all "
     "whose weights\n"
     "                     are there\n"
     "    bilateral-without=NAMES  corrected only: features that bilateral is not to look at, as "
     "`without`\n"
     "    oidn-features=prefiltered  corrected only: prefiltered, or noisy: oidn's `features`, a "
     "third of "
     "its time\n"},
    {"nfor", MakeNfor,
     "first-order regression on the features with weights of non-local means, each half of the\n"
     "             samples judged by the other; Bitterli et al. 2016\n"},
    {"oidn", MakeOidn,
     "Open Image Denoise's published networks; their weights: deploy/fetch-oidn, but where the "
     "build\n"
     "             has its library, which is run then; Afra 2025\n"
     "    features=prefiltered  albedo and normal through networks of their own first; or noisy: "
     "as "
     "they are;\n"
     "                     or none\n"
     "    size=base        of the network for colour; or small, or, with prefiltered features, "
     "large\n"},
    {"sbf", MakeSbf,
     "cross-bilateral filter on normal, albedo and depth, the window of each pixel by SURE; Li, "
     "Wu,\n"
     "            Chuang 2012\n"},
    {"sbf-gradient", MakeSbfGradient,
     "sbf, with the gradient of the prefiltered image as one more feature; Xing, Chen, Li 2020\n"},
    {"nlm", MakeNlm,
     "non-local means of each half by weights from the other; Rousselle, Knaus, Zwicker 2012\n"},
    {"rd", MakeRd,
     "robust denoising: the least of the weights by colour and by each prefiltered feature, three\n"
     "             candidates chosen by SURE, and once more; Rousselle, Manzi, Zwicker "
     "2013\n"
     "    radius=10        of the window, pixels, 1 to 20; 5 takes half of the time\n"},
    {"rpf", MakeRpf,
     "random parameter filtering, of samples by what they depend on; needs --keep-samples; slow; "
     "Sen,\n"
     "             Darabi 2012\n"
     "    neighbours=2048  samples that a pixel is filtered by, at most, in each of four passes, 0 "
     "to "
     "131072;\n"
     "                     0: as many as the paper draws\n"
     "    variance=0.02    above 0, at most 100, of normalised colours and features at 8 samples a "
     "pixel; "
     "the\n"
     "                     paper has 0.002 for images with little noise\n"},
    {"wlr", MakeWlr,
     "local linear fits in the features' own space, their width by bias and variance; Moon, Carr,\n"
     "             Yoon 2014\n"},
};

// Of filters that look at the samples themselves, which some parameters can't change.
void RejectWithSamples(const Denoiser& denoiser, const std::string& name, const char* but) {
    if (denoiser.GetNeeds().samples) {
        ThrowInvalidArgument(fmt::format("filter '{}' looks at samples, and {}", name, but));
    }
}

}  // namespace

std::unique_ptr<Denoiser> MakeDenoiser(const std::string& text) {
    const NamedParams named = ParseNamedParams(text);
    std::string known;
    for (const auto& entry : kDenoisers) {
        if (named.name == entry.name) {
            auto denoiser = entry.make(named.params);
            if (named.params.Has("without")) {
                denoiser =
                    WithoutFeatures(std::move(denoiser), named.params.GetString("without", ""));
            }
            if (named.params.GetChoice("lights", "keep", {"keep", "apart"}) == "apart") {
                denoiser = LightsApart(std::move(denoiser));
            }
            if (named.params.GetChoice("fireflies", "keep", {"keep", "spread"}) == "spread") {
                RejectWithSamples(*denoiser, named.name,
                                  "fireflies=spread changes pixels; leave it out");
                denoiser = OnChangedFrame(std::move(denoiser), "fireflies=spread",
                                          [](Frame* frame) { SpreadFireflies(frame); });
            }
            if (named.params.GetChoice("energy", "keep", {"keep", "restore"}) == "restore") {
                denoiser = RestoreEnergy(std::move(denoiser));
            }
            if (named.params.GetChoice("where", "all", {"all", "noisy"}) == "noisy") {
                RejectWithSamples(*denoiser, named.name,
                                  "parts of an image have none; leave where=noisy out");
                denoiser = OnNoisyPart(std::move(denoiser), kWhereNoisy);
            }
            named.params.RejectUnused("filter '" + named.name + "'");
            return denoiser;
        }
        known += (known.empty() ? "" : ", ") + std::string(entry.name);
    }
    ThrowInvalidArgument(fmt::format("unknown filter '{}'; known: {}", named.name, known));
}

std::string DescribeDenoisers() {
    std::string text;
    for (const auto& entry : kDenoisers) {
        text += fmt::format("{:<12} {}", entry.name, entry.help);
    }
    text +=
        "Every filter also takes\n"
        "    without=NAMES    features that it is not to look at, joined by '-': normal, albedo, "
        "depth, "
        "visibility\n"
        "    fireflies=keep   keep; or spread: pixels that one bright sample made are spread over "
        "their\n"
        "                     neighbours first\n"
        "    lights=keep      keep; or apart: lamps that the camera sees, where they are noisy, "
        "are "
        "taken out\n"
        "                     first, and come back as they were\n"
        "    energy=keep      keep; or restore: bright pixels are made brighter so that the "
        "image's "
        "light is\n"
        "                     the samples'\n"
        "    where=all        all; or noisy: a rectangle outside of which is next to no noise, and "
        "which\n"
        "                     stays as it is\n";
    return text;
}

}  // namespace relume::denoise

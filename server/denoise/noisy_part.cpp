#include "server/denoise/noisy_part.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "core/image/metrics.h"
#include "server/denoise/crop_frame.h"
#include "server/denoise/wrapped_denoiser.h"

namespace relume::denoise {
namespace {

constexpr double kQuiet = 1e-3;       // of all noise, that may be left outside
constexpr double kMostOfFrame = 0.9;  // a larger part isn't worth the copy
constexpr int kMargin = 8;            // pixels: whose neighbours help those at the edge
constexpr int kLeastSide = 64;        // pixels: filters look around that far

std::size_t At(int x, int y, int width) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
}

float SquaredBrightness(const Frame& frame, std::size_t c, std::size_t i) {
    const float color = frame.color[c][i];
    return color * color + static_cast<float>(kRelMSEEpsilon);
}

Plane RelativeNoise(const Frame& frame) {
    Plane noise(frame.pixel_count());
    for (std::size_t i = 0; i < noise.size(); ++i) {
        float sum = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            sum += frame.variance[c][i] / SquaredBrightness(frame, c, i);
        }
        noise[i] = std::clamp(sum * (1.0f / 3.0f), 0.0f, 1.0f);
    }
    return noise;
}

// Takes rows and columns from the sides, first those with the least noise a pixel, as long as all
// that is taken has no more than `most`.
TileRect Trim(const Plane& noise, int width, int height, double most) {
    TileRect rect{0, 0, width, height};
    const auto sum = [&](int x0, int y0, int x1, int y1) {
        double total = 0;
        for (int y = y0; y < y1; ++y) {
            for (int x = x0; x < x1; ++x) {
                total += noise[At(x, y, width)];
            }
        }
        return total;
    };
    while (rect.width() > 1 && rect.height() > 1) {
        const auto [x0, y0, x1, y1] = rect;
        const std::array<double, 4> sides = {sum(x0, y0, x0 + 1, y1), sum(x1 - 1, y0, x1, y1),
                                             sum(x0, y0, x1, y0 + 1), sum(x0, y1 - 1, x1, y1)};
        std::optional<std::size_t> least;
        const auto mean = [&](std::size_t k) {
            return sides[k] / (k < 2 ? rect.height() : rect.width());
        };
        for (std::size_t k = 0; k < sides.size(); ++k) {
            if (sides[k] <= most && (!least || mean(k) < mean(*least))) {
                least = k;
            }
        }
        if (!least) {
            break;
        }
        most -= sides[*least];
        int* const ends[] = {&rect.x0, &rect.x1, &rect.y0, &rect.y1};
        *ends[*least] += *least % 2 == 0 ? 1 : -1;
    }
    return rect;
}

// With a margin, and at least kLeastSide long, as far as there is room.
void Widen(int* begin, int* end, int size) {
    const int least = std::min(kLeastSide, size);
    const int margin = std::max(kMargin, (least - (*end - *begin) + 1) / 2);
    *begin = std::clamp(*begin - margin, 0, size - least);
    *end = std::clamp(*end + margin, *begin + least, size);
}

class NoisyPartOnly final : public Denoiser {
  public:
    NoisyPartOnly(std::shared_ptr<const Denoiser> denoiser, std::string parameter)
        : denoiser_(std::move(denoiser)), parameter_(std::move(parameter)) {}

    std::string Describe() const override {
        return WithParameter(denoiser_->Describe(), parameter_);
    }
    Needs GetNeeds() const override { return denoiser_->GetNeeds(); }
    const Denoiser* OfNoisyPart() const override { return denoiser_.get(); }

    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        const TileRect rect = FindNoisyPart(frame);
        if (IsWhole(rect, frame)) {
            return denoiser_->Choose(frame, cancel);
        }
        std::optional<Choice> choice = denoiser_->Choose(CropFrame(frame, rect), cancel);
        if (choice) {
            choice->denoiser = OnPart(choice->denoiser);
            if (choice->base) {
                choice->base = OnPart(choice->base);
            }
            if (choice->base_error) {
                choice->base_error = std::make_shared<const ErrorEstimate>(
                    ExpandEstimate(*choice->base_error, rect, frame));
            }
            for (Choice::Candidate& candidate : choice->candidates) {
                candidate.filter = OnPart(MakeDenoiser(candidate.filter))->Describe();
            }
        }
        return choice;
    }

    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        const TileRect rect = FindNoisyPart(frame);
        if (IsWhole(rect, frame)) {
            return denoiser_->Reconstruct(frame, cancel);
        }
        const Result part = RunDenoiser(*denoiser_, CropFrame(frame, rect), cancel);
        Result result;
        std::ranges::copy(frame.color, std::begin(result.color));
        if (part.error) {
            result.error.emplace(frame.pixel_count());
            for (std::size_t i = 0; i < frame.pixel_count(); ++i) {
                (*result.error)[i] =
                    (frame.variance[0][i] + frame.variance[1][i] + frame.variance[2][i]) *
                    (1.0f / 3.0f);
            }
            PastePlane(*part.error, rect, frame.width, &*result.error);
        }
        if (part.derivative) {
            result.derivative.emplace();
        }
        for (std::size_t c = 0; c < 3; ++c) {
            PastePlane(part.color[c], rect, frame.width, &result.color[c]);
            if (part.derivative) {
                Plane& derivative = (*result.derivative)[c];
                derivative.assign(frame.pixel_count(), 1.0f);
                PastePlane((*part.derivative)[c], rect, frame.width, &derivative);
            }
        }
        result.notes = part.notes;
        result.notes["where"] = fmt::format(
            "{}x{}+{}+{}, {:.0f} %", rect.width(), rect.height(), rect.x0, rect.y0,
            100.0 * static_cast<double>(rect.area()) / static_cast<double>(frame.pixel_count()));
        return result;
    }

    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        return denoiser_->PlanSamples(frame, samples, cancel);
    }

  private:
    std::shared_ptr<const Denoiser> denoiser_;
    std::string parameter_;

    static std::shared_ptr<const Denoiser> OnPart(std::shared_ptr<const Denoiser> denoiser) {
        return denoiser->Describe() == "none" ? denoiser
                                              : OnNoisyPart(std::move(denoiser), kWhereNoisy);
    }
};

}  // namespace

TileRect FindNoisyPart(const Frame& frame) {
    const TileRect whole{0, 0, frame.width, frame.height};
    const Plane noise = RelativeNoise(frame);
    double total = 0;
    for (const float n : noise) {
        total += n;
    }
    if (!(total > 0)) {
        return whole;
    }
    TileRect rect = Trim(noise, frame.width, frame.height, kQuiet * total);
    Widen(&rect.x0, &rect.x1, frame.width);
    Widen(&rect.y0, &rect.y1, frame.height);
    return static_cast<double>(rect.area()) > kMostOfFrame * static_cast<double>(whole.area())
               ? whole
               : rect;
}

bool IsWhole(const TileRect& rect, const Frame& frame) {
    return rect.width() == frame.width && rect.height() == frame.height;
}

ErrorEstimate ExpandEstimate(const ErrorEstimate& of_part, const TileRect& rect,
                             const Frame& frame) {
    const std::array<Plane, 3> noise = VarianceByHalves(frame);
    const auto pixels = static_cast<double>(frame.pixel_count());
    Plane map(frame.pixel_count());
    double outside = 0;
    for (int y = 0; y < frame.height; ++y) {
        for (int x = 0; x < frame.width; ++x) {
            if (x >= rect.x0 && x < rect.x1 && y >= rect.y0 && y < rect.y1) {
                continue;
            }
            const std::size_t i = At(x, y, frame.width);
            double error = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                error += noise[c][i] / (3 * SquaredBrightness(frame, c, i));
            }
            map[i] = static_cast<float>(error);
            outside += error / pixels;
        }
    }
    const double share = static_cast<double>(rect.area()) / pixels;
    ErrorEstimate whole;
    whole.relmse = share * of_part.relmse + outside;
    whole.low = share * of_part.low + outside;
    whole.high = share * of_part.high + outside;
    whole.unfiltered = share * of_part.unfiltered + outside;
    if (!of_part.map.empty()) {
        whole.map = std::move(map);
        PastePlane(of_part.map, rect, frame.width, &whole.map);
    }
    return whole;
}

std::unique_ptr<Denoiser> OnNoisyPart(std::shared_ptr<const Denoiser> denoiser,
                                      const std::string& parameter) {
    return std::make_unique<NoisyPartOnly>(std::move(denoiser), parameter);
}

}  // namespace relume::denoise

// No filter: the mean of the samples. No parameters. The estimated error is the variance of that
// mean.
#include "server/denoise/denoiser.h"
#include "server/denoise/planes.h"

namespace relume::denoise {
namespace {

class None final : public Denoiser {
  public:
    std::string Describe() const override { return "none"; }

    Result Reconstruct(const Frame& frame, const CancelToken&) const override {
        Result result;
        for (int c = 0; c < 3; ++c) {
            result.color[c] = frame.color[c];
        }
        const Plane one(frame.pixel_count(), 1.0f);
        result.derivative = {one, one, one};
        result.error = AverageOfThree(frame.variance);
        return result;
    }
};

}  // namespace

std::unique_ptr<Denoiser> MakeNone(const ParamSet&) { return std::make_unique<None>(); }

}  // namespace relume::denoise

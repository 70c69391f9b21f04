#pragma once

#include <memory>
#include <string>
#include <utility>

#include "server/denoise/denoiser.h"

namespace relume::denoise {

// A filter's name with one more parameter, "nfor:energy=restore"; an empty one adds nothing.
inline std::string WithParameter(const std::string& name, const std::string& parameter) {
    return parameter.empty() ? name
                             : name + (name.find(':') == std::string::npos ? ":" : ",") + parameter;
}

// A filter around another one, which passes on all but its name and its image.
class WrappedDenoiser : public Denoiser {
  public:
    explicit WrappedDenoiser(std::unique_ptr<Denoiser> denoiser) : denoiser_(std::move(denoiser)) {}

    Needs GetNeeds() const override { return denoiser_->GetNeeds(); }
    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        return denoiser_->Choose(frame, cancel);
    }
    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        return denoiser_->PlanSamples(frame, samples, cancel);
    }

  protected:
    const Denoiser& inner() const { return *denoiser_; }

  private:
    std::unique_ptr<Denoiser> denoiser_;
};

}  // namespace relume::denoise

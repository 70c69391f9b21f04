#include "server/denoise/on_changed_frame.h"

#include <utility>

#include "server/denoise/wrapped_denoiser.h"

namespace relume::denoise {
namespace {

class ChangedFrame final : public Denoiser {
  public:
    ChangedFrame(std::unique_ptr<Denoiser> denoiser, const std::string& parameter,
                 std::function<void(Frame*)> change)
        : denoiser_(std::move(denoiser)), parameter_(parameter), change_(std::move(change)) {}

    std::string Describe() const override {
        return WithParameter(denoiser_->Describe(), parameter_);
    }
    Needs GetNeeds() const override { return denoiser_->GetNeeds(); }
    std::optional<Choice> Choose(const Frame& frame, const CancelToken& cancel) const override {
        return denoiser_->Choose(Changed(frame), cancel);
    }
    Result Reconstruct(const Frame& frame, const CancelToken& cancel) const override {
        return denoiser_->Reconstruct(Changed(frame), cancel);
    }
    Plane PlanSamples(const Frame& frame, double samples,
                      const CancelToken& cancel) const override {
        return denoiser_->PlanSamples(Changed(frame), samples, cancel);
    }

  private:
    Frame Changed(const Frame& frame) const {
        Frame changed = frame;
        change_(&changed);
        return changed;
    }

    std::unique_ptr<Denoiser> denoiser_;
    std::string parameter_;
    std::function<void(Frame*)> change_;
};

}  // namespace

std::unique_ptr<Denoiser> OnChangedFrame(std::unique_ptr<Denoiser> denoiser,
                                         const std::string& parameter,
                                         std::function<void(Frame*)> change) {
    return std::make_unique<ChangedFrame>(std::move(denoiser), parameter, std::move(change));
}

}  // namespace relume::denoise

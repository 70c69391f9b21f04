#include <fmt/format.h>

#include <utility>

#include "core/base/log.h"
#include "server/rpc/coordinator.h"

// Of Coordinator: what clients ask of jobs that are under way. Each is answered when it is on the
// disk.
namespace relume::server {

void Coordinator::CancelJob(const std::string& name, bool discard, Done done) {
    const bool was_over = jobs::IsOver(queue_.Get(name).state);
    if (discard) {
        queue_.Cancel(name, Now());
    } else {
        queue_.CancelKeepingImage(name, Now());
    }
    const jobs::JobInfo& info = queue_.Get(name);
    Record& record = records_.at(name);
    const LogScope scope({.job = name});
    if (!was_over) {
        spdlog::info("{}: cancelled{}", name,
                     jobs::IsOver(info.state) ? "" : ", what is there becomes the image");
    }
    if (jobs::IsOver(info.state)) {
        record.cancel->Cancel();
        record.over = true;
        keeper_.Over(name);
    }
    Write(RowOf(info), false, std::move(done));
}

void Coordinator::PauseJob(const std::string& name, Done done) {
    queue_.Pause(name, Now());
    const LogScope scope({.job = name});
    spdlog::info("{}: paused", name);
    Write(RowOf(queue_.Get(name)), false, std::move(done));
}

void Coordinator::ResumeJob(const std::string& name, Done done) {
    queue_.Resume(name, Now());
    const LogScope scope({.job = name});
    spdlog::info("{}: resumed", name);
    Write(RowOf(queue_.Get(name)), false, std::move(done));
}

void Coordinator::UpdateJob(const std::string& name, std::optional<int> priority, Done done) {
    if (priority) {
        queue_.SetPriority(name, *priority, Now());
        Record& record = records_.at(name);
        record.spec.message.set_priority(*priority);
        record.brief.set_priority(*priority);
        const LogScope scope({.job = name});
        spdlog::info("{}: priority {}", name, *priority);
    }
    Write(RowOf(queue_.Get(name)), false, std::move(done));
}

}  // namespace relume::server

#include "server/rpc/job_watcher.h"

#include <utility>

#include "server/rpc/status.h"

namespace relume::server {

JobWatcher* JobWatcher::Start(Coordinator* coordinator, const std::string& name,
                              std::uint64_t from_event, StreamLimit::Slot slot) {
    const std::shared_ptr<JobWatcher> watcher(
        new JobWatcher(coordinator, name, from_event, std::move(slot)));
    watcher->self_ = watcher;
    coordinator->control().Post([watcher] {
        watcher->coordinator_->AddWatcher(watcher.get());
        watcher->Advance();
    });
    return watcher.get();
}

void JobWatcher::OnWriteDone(bool ok) {
    coordinator_->control().Post([self = self_, ok] {
        self->writing_ = false;
        self->gone_ = self->gone_ || !ok;
        self->Advance();
    });
}

void JobWatcher::OnCancel() {
    coordinator_->control().Post([self = self_] {
        self->gone_ = true;
        self->Advance();
    });
}

void JobWatcher::OnDone() { const auto self = std::move(self_); }

void JobWatcher::Advance() {
    if (writing_ || finished_) {
        return;
    }
    if (gone_) {
        End({grpc::StatusCode::CANCELLED, "the watcher went away"});
        return;
    }
    if (coordinator_->stopping()) {
        End({grpc::StatusCode::UNAVAILABLE, "the server stops"});
        return;
    }
    bool over = false;
    const grpc::Status status = Guard([&] {
        const auto event = coordinator_->queue().FindEvent(name_, next_event_);
        if (event) {
            response_.Clear();
            response_.set_event(event->number);
            coordinator_->FillJob(*event->job, false, response_.mutable_job());
            next_event_ = event->number + 1;
            writing_ = true;
        } else {
            over = jobs::IsOver(coordinator_->queue().Get(name_).state);
        }
    });
    if (!status.ok() || over) {
        End(status);
    } else if (writing_) {
        StartWrite(&response_);
    }
}

void JobWatcher::Stop() { Advance(); }

void JobWatcher::End(const grpc::Status& status) {
    finished_ = true;
    coordinator_->Remove(this);
    Finish(status);
}

}  // namespace relume::server

#include "server/metrics/families.h"

#include <string>
#include <utility>

#include "proto/codec/protocol.h"

namespace relume::metrics {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

class Families {
  public:
    // Begins a family; Add puts series into it.
    Families& Counter(const char* name, const char* help) {
        return Begin(name, help, MetricType::Counter);
    }
    Families& Gauge(const char* name, const char* help) {
        return Begin(name, help, MetricType::Gauge);
    }
    Families& Add(double value, Labels labels = {}) {
        ClientMetric metric;
        metric.label = std::move(labels);
        (list_.back().type == MetricType::Counter ? metric.counter.value : metric.gauge.value) =
            value;
        list_.back().metric.push_back(std::move(metric));
        return *this;
    }
    Families& Add(std::uint64_t value, Labels labels = {}) {
        return Add(static_cast<double>(value), std::move(labels));
    }
    // A sum and how many it is of.
    void Summary(const char* name, const char* help, double sum, std::uint64_t count) {
        Begin(name, help, MetricType::Summary);
        ClientMetric& metric = list_.back().metric.emplace_back();
        metric.summary.sample_sum = sum;
        metric.summary.sample_count = count;
    }
    std::vector<MetricFamily> Take() { return std::move(list_); }

  private:
    Families& Begin(const char* name, const char* help, MetricType type) {
        list_.push_back({name, help, type, {}});
        return *this;
    }
    std::vector<MetricFamily> list_;
};

std::string Version() {
    const std::string build = kBuild;
    return build.substr(build.find(' ') + 1);
}

std::string WithoutParameters(const std::string& text) { return text.substr(0, text.find(':')); }

void AddJobs(const jobs::QueueStatus& queue, Families* f) {
    f->Gauge("relume_jobs", "Jobs that are not over, by state.")
        .Add(queue.queued, {{"state", "queued"}})
        .Add(queue.rendering, {{"state", "rendering"}})
        .Add(queue.filtering, {{"state", "filtering"}})
        .Add(queue.paused, {{"state", "paused"}});
    f->Counter("relume_jobs_finished_total", "Jobs that are over, by how they ended.")
        .Add(queue.totals.succeeded, {{"state", "succeeded"}})
        .Add(queue.totals.failed, {{"state", "failed"}})
        .Add(queue.totals.cancelled, {{"state", "cancelled"}});
    f->Summary("relume_job_wait_seconds", "From a job's making to its first lease.",
               queue.totals.wait_seconds, queue.totals.waited);
    f->Gauge("relume_jobs_oldest_wait_seconds",
             "Longest time that a job has waited for its first lease so far; 0: none waits.")
        .Add(queue.oldest_wait_seconds);
    f->Gauge("relume_remaining_core_seconds",
             "Predicted thread time of workers to render what is left of jobs that are not paused.")
        .Add(queue.core_seconds_left);
    f->Gauge("relume_jobs_unpredicted",
             "Jobs that relume_remaining_core_seconds lacks: nothing tells yet how long they take.")
        .Add(queue.unpredicted);
    f->Gauge("relume_active_pixels", "Pixels that get samples in the newest pass of their job.")
        .Add(queue.active_pixels);
}

// The series of each job under way: `value` of those that have one.
template <typename Value>
void AddOfEachJob(const jobs::QueueStatus& queue, Value value, Families* f) {
    for (const auto& job : queue.under_way) {
        if (const std::optional<double> v = value(job)) {
            f->Add(*v, {{"job_name", job.name}});
        }
    }
}

void AddJobsUnderWay(const FarmStatus& status, Families* f) {
    using jobs::JobStatus;
    const auto& queue = status.queue;
    f->Gauge("relume_job_info", "1 for each job under way: what people call it, how it is made.");
    for (std::size_t i = 0; i < queue.under_way.size(); ++i) {
        const JobText& text = status.job_texts.at(i);
        const JobStatus& job = queue.under_way[i];
        f->Add(1.0, {{"job_name", job.name},
                     {"title", text.title},
                     {"owner", text.owner},
                     {"priority", std::to_string(text.priority)},
                     {"state", job.paused                                ? "paused"
                               : job.state == jobs::JobState::kRendering ? "rendering"
                                                                         : "filtering"},
                     {"sampler", WithoutParameters(text.sampler)},
                     {"filter", WithoutParameters(text.filter)}});
    }
    f->Counter("relume_job_samples_total", "Samples of each job under way.");
    AddOfEachJob(
        queue, [](const JobStatus& j) { return static_cast<double>(j.samples); }, f);
    f->Gauge("relume_job_share",
             "Part of the farm's core-seconds of the last minute, of each job under way.");
    AddOfEachJob(
        queue, [](const JobStatus& j) { return j.share; }, f);
    f->Gauge("relume_job_active_pixels", "As relume_active_pixels, of each job under way.");
    AddOfEachJob(
        queue, [](const JobStatus& j) { return static_cast<double>(j.active_pixels); }, f);
    f->Gauge("relume_job_relmse",
             "Estimated relative mean squared error of each job under way, by image.");
    for (const JobStatus& job : queue.under_way) {
        if (job.relmse) {
            f->Add(*job.relmse, {{"job_name", job.name}, {"image", "unfiltered"}});
        }
        if (job.image_relmse) {
            f->Add(*job.image_relmse, {{"job_name", job.name}, {"image", "returned"}});
        }
    }
    f->Gauge("relume_job_remaining_core_seconds",
             "As relume_remaining_core_seconds, of each job under way that can be predicted.");
    AddOfEachJob(
        queue, [](const JobStatus& j) { return j.core_seconds_left; }, f);
    f->Gauge("relume_job_eta_seconds", "Predicted time to the result of each job under way.");
    AddOfEachJob(
        queue, [](const JobStatus& j) { return j.eta_seconds; }, f);
}

void AddRendering(const jobs::QueueStatus& queue, Families* f) {
    const jobs::JobTotals& totals = queue.totals;
    f->Counter("relume_samples_total", "Samples rendered, each counted once.").Add(totals.samples);
    f->Counter("relume_bad_samples_total", "Of these, samples that were not finite.")
        .Add(totals.bad_samples);
    f->Counter("relume_rays_total", "Rays traced for the samples.").Add(totals.rays);
    f->Counter("relume_render_core_seconds_total", "Thread time of workers in leases that count.")
        .Add(totals.busy_seconds);
    f->Gauge("relume_leases", "Leases that are out, by state.")
        .Add(queue.leases_lent, {{"state", "lent"}})
        .Add(queue.leases_late, {{"state", "late"}})
        .Add(queue.leases_abandoned, {{"state", "abandoned"}});
    f->Gauge("relume_units_waiting", "Units of work that wait to be lent.")
        .Add(queue.units_waiting);
    f->Counter("relume_leases_issued_total", "Leases given out, repetitions included.")
        .Add(totals.leases_issued);
    f->Counter("relume_leases_reissued_total", "Of these, units given out again.")
        .Add(totals.leases_reissued);
    f->Counter("relume_results_duplicate_total", "Results that came late or twice: dropped.")
        .Add(totals.results_duplicate);
    f->Counter("relume_results_wrong_total", "Results that failed their check: refused.")
        .Add(queue.results_wrong);
    f->Counter("relume_cross_checks_total",
               "Units chosen for a second worker's answer: equal, odd (wrong answers), alone.")
        .Add(queue.checks.equal, {{"outcome", "equal"}})
        .Add(queue.checks.odd, {{"outcome", "odd"}})
        .Add(queue.checks.alone, {{"outcome", "alone"}});
    f->Counter("relume_plan_seconds_total", "The server's time to plan passes.")
        .Add(totals.plan_seconds);
    f->Counter("relume_merge_seconds_total", "The server's time to read, check and merge results.")
        .Add(totals.merge_seconds);
    f->Summary("relume_filter_seconds", "Time of the final filter, of jobs that succeeded.",
               totals.filter_seconds, totals.filtered);
}

void AddWorkers(const jobs::QueueStatus& queue, Families* f) {
    f->Gauge("relume_workers", "Workers that are connected, by state.")
        .Add(queue.workers_responding, {{"state", "responding"}})
        .Add(queue.workers_silent, {{"state", "silent"}})
        .Add(queue.workers_quarantined, {{"state", "quarantined"}});
    f->Gauge("relume_worker_threads", "Render threads of all workers that are connected.")
        .Add(queue.threads);
    f->Counter("relume_worker_samples_total", "Samples of each worker since it connected.");
    for (const auto& worker : queue.workers) {
        f->Add(worker.samples_done, {{"worker", worker.name}});
    }
    f->Gauge("relume_worker_samples_per_second",
             "Speed of each worker while it renders, all threads; 0: not measured yet.");
    for (const auto& worker : queue.workers) {
        f->Add(worker.samples_per_second, {{"worker", worker.name}});
    }
    f->Gauge("relume_worker_leases", "Leases that each worker holds.");
    for (const auto& worker : queue.workers) {
        f->Add(static_cast<double>(worker.leases_held), {{"worker", worker.name}});
    }
    f->Gauge("relume_series_left_out", "Jobs under way and workers without series of their own.")
        .Add(queue.under_way_left_out, {{"of", "jobs"}})
        .Add(queue.workers_responding + queue.workers_silent + queue.workers_quarantined -
                 queue.workers.size(),
             {{"of", "workers"}});
}

void AddServer(const FarmStatus& status, Families* f) {
    f->Counter("relume_received_bytes_total", "Bytes that came in: scene files, workers' messages.")
        .Add(status.blobs_in, {{"kind", "blob"}})
        .Add(status.work_in, {{"kind", "work"}});
    f->Counter("relume_sent_bytes_total",
               "Bytes that went out: scene files, messages to workers, images.")
        .Add(status.blobs_out, {{"kind", "blob"}})
        .Add(status.work_out, {{"kind", "work"}})
        .Add(status.results_out, {{"kind", "result"}});
    f->Gauge("relume_blob_store_bytes", "Scene files on the server's disk.").Add(status.blob_bytes);
    f->Gauge("relume_blob_store_quota_bytes", "The most that they may take.")
        .Add(status.blob_quota);
    f->Gauge("relume_server_tasks_waiting", "Tasks that wait for a thread of the server.");
    for (const auto& [thread, count] : status.tasks_waiting) {
        f->Add(static_cast<double>(count), {{"thread", thread}});
    }
}

}  // namespace

std::vector<MetricFamily> MakeFamilies(const std::optional<FarmStatus>& status) {
    Families families;
    families.Gauge("relume_build_info", "1, with the server's version.")
        .Add(1.0, {{"version", Version()}, {"protocol", std::to_string(kProtocolVersion)}});
    families
        .Gauge("relume_coordinator_responding",
               "1; 0: it did not answer, and nothing else is told.")
        .Add(status ? 1.0 : 0.0);
    if (status) {
        AddRendering(status->queue, &families);
        AddJobs(status->queue, &families);
        AddJobsUnderWay(*status, &families);
        AddWorkers(status->queue, &families);
        AddServer(*status, &families);
    }
    return families.Take();
}

}  // namespace relume::metrics

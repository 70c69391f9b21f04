#include "client/lib/report.h"

#include <algorithm>

#include "client/lib/job_names.h"
#include "proto/codec/protocol.h"

namespace relume::client {
namespace {

using Json = nlohmann::ordered_json;

Json SceneJson(const v1::Job& job, const ReportFacts& facts) {
    std::uint64_t bytes = 0;
    for (const auto& entry : facts.scene.entries) {
        bytes += entry.size;
    }
    return {{"main", facts.scene.main},
            {"files", facts.scene.entries.size()},
            {"bytes", bytes},
            {"sha256", job.scene_sha256()}};
}

Json SettingsJson(const v1::JobSpec& spec, std::optional<double> time_limit) {
    const v1::RenderSettings& s = spec.settings();
    Json json{{"width", s.width()},
              {"height", s.height()},
              {"crop", nullptr},
              {"spp", OrNull(spec.spp() > 0, spec.spp())},
              {"min_spp", OrNull(spec.has_min_spp(), spec.min_spp())},
              {"max_spp", OrNull(spec.has_max_spp(), spec.max_spp())},
              {"target", OrNull(spec.has_target(), spec.target())},
              {"time_limit", OrNull(spec.has_time_limit(), time_limit.value_or(spec.time_limit()))},
              {"sampler", spec.sampler()},
              {"filter", spec.filter()},
              {"seed", s.seed()},
              {"max_depth", s.max_depth()},
              {"camera", s.camera()},
              {"lens_radius", nullptr},
              {"focus_distance", nullptr},
              {"time", nullptr},
              {"shutter", nullptr},
              {"environment", s.environment()},
              {"environment_scale", s.environment_scale()},
              {"allow_black", s.allow_black()},
              {"look", nullptr},
              {"tile_size", spec.tile_size()},
              {"layers", spec.all_layers() ? "all" : "basic"},
              {"keep_samples", spec.keep_samples()}};
    if (s.has_crop()) {
        json["crop"] = {s.crop().x0(), s.crop().y0(), s.crop().x1(), s.crop().y1()};
    }
    if (s.has_lens_radius()) {
        json["lens_radius"] = s.lens_radius();
    }
    if (s.has_focus_distance()) {
        json["focus_distance"] = s.focus_distance();
    }
    if (s.has_time()) {
        json["time"] = s.time();
    }
    if (s.has_shutter()) {
        json["shutter"] = s.shutter();
    }
    if (s.has_look()) {
        const auto vector = [](const v1::Vector& v) { return Json{v.x(), v.y(), v.z()}; };
        json["look"] = {{"from", vector(s.look().from())},
                        {"at", vector(s.look().at())},
                        {"up", vector(s.look().up())},
                        {"fov", s.look().fov_degrees()}};
    }
    return json;
}

Json PassesJson(const v1::Job& job) {
    Json passes = Json::array();
    for (const auto& pass : job.passes()) {
        passes.push_back(
            {{"index", pass.index()},
             {"samples", pass.samples()},
             {"active_pixels", pass.active_pixels()},
             {"relmse", pass.relmse()},
             {"image_relmse", OrNull(pass.has_image_relmse(), pass.image_relmse())},
             {"relmse_predicted", OrNull(pass.has_relmse_predicted(), pass.relmse_predicted())},
             {"seconds", pass.seconds()},
             {"plan_seconds", pass.plan_seconds()},
             {"ranges", pass.ranges()}});
    }
    return passes;
}

Json WorkersJson(const v1::Job& job) {
    std::uint64_t total = 0;
    for (const auto& worker : job.workers()) {
        total += worker.samples();
    }
    Json workers = Json::array();
    for (const auto& worker : job.workers()) {
        workers.push_back(
            {{"name", worker.worker()},
             {"samples", worker.samples()},
             {"share",
              total > 0 ? static_cast<double>(worker.samples()) / static_cast<double>(total) : 0},
             {"leases", worker.leases()},
             {"busy_seconds", worker.busy_seconds()}});
    }
    return workers;
}

Json ErrorJson(const v1::EstimatedError& error) {
    return {{"relmse", error.relmse()}, {"low", error.low()}, {"high", error.high()}};
}

// What was expected, beside what came of it.
Json ForecastJson(const v1::Job& job) {
    Json curve = Json::array();
    for (const auto& point : job.forecast()) {
        curve.push_back({{"samples", point.samples()},
                         {"seconds", point.seconds()},
                         {"relmse", point.relmse()}});
    }
    const bool known = job.has_predicted_seconds();
    return {{"seconds", OrNull(known, job.predicted_seconds())},
            {"seconds_low", OrNull(known, job.predicted_low_seconds())},
            {"seconds_high", OrNull(known, job.predicted_high_seconds())},
            {"seconds_real", job.elapsed_seconds()},
            {"finish_seconds",
             OrNull(job.finish_seconds_predicted() > 0, job.finish_seconds_predicted())},
            {"curve", curve}};
}

Json FilterJson(const v1::FilterSummary& filter) {
    Json json{{"filter", filter.filter()},
              {"seconds", filter.seconds()},
              {"mse", nullptr},
              {"error", nullptr},
              {"unfiltered_error", ErrorJson(filter.noisy())},
              {"candidates", Json::array()},
              {"reason", filter.reason()},
              {"dropped", filter.dropped()},
              {"notes", Json::object()}};
    for (const auto& candidate : filter.candidates()) {
        json["candidates"].push_back({{"filter", candidate.filter()},
                                      {"relmse", candidate.relmse()},
                                      {"above_best", candidate.above_best()},
                                      {"uncertainty", candidate.uncertainty()},
                                      {"seconds", candidate.seconds()}});
    }
    if (filter.has_mse()) {
        json["mse"] = filter.mse();
    }
    if (filter.has_filtered()) {
        json["error"] = ErrorJson(filter.filtered());
    }
    for (const auto& [key, value] : filter.notes()) {
        json["notes"][key] = value;
    }
    return json;
}

// Each note once, the preflight's first.
Json NotesJson(const v1::Job& job, const ReportFacts& facts) {
    std::vector<std::string> notes = facts.notes;
    for (const auto& note : job.notes()) {
        if (std::find(notes.begin(), notes.end(), note) == notes.end()) {
            notes.push_back(note);
        }
    }
    return notes;
}

double PerSecond(std::uint64_t count, double seconds) {
    return seconds > 0 ? static_cast<double>(count) / seconds : 0;
}

}  // namespace

double PixelsOf(const v1::JobSpec& spec) {
    const v1::RenderSettings& s = spec.settings();
    if (s.has_crop()) {
        return static_cast<double>(s.crop().x1() - s.crop().x0()) * (s.crop().y1() - s.crop().y0());
    }
    return static_cast<double>(s.width()) * s.height();
}

double MeanSpp(const v1::Job& job) {
    const double pixels = PixelsOf(job.spec());
    return pixels > 0 ? static_cast<double>(job.samples_done()) / pixels : 0;
}

Json LedgerJson(const v1::Job& job) {
    if (!job.has_ledger()) {
        return nullptr;
    }
    const v1::LedgerAudit& audit = job.ledger();
    return {{"ranges", audit.ranges()},
            {"samples", audit.samples()},
            {"film_samples", audit.film_samples()},
            {"clean", audit.problem().empty()},
            {"problem", OrNull(!audit.problem().empty(), audit.problem())}};
}

Json MakeReport(const v1::Job& job, const ReportFacts& facts) {
    const double wait = std::max(0.0, facts.job - job.render_seconds() - job.filter().seconds());
    return {
        {"version", kBuild},
        {"job", job.name()},
        {"state", StateName(job.state())},
        {"why_stopped", job.message()},
        {"stop_reason", StopReasonName(job.stop_reason())},
        {"scene", SceneJson(job, facts)},
        {"settings", SettingsJson(job.spec(), facts.time_limit)},
        {"notes", NotesJson(job, facts)},
        {"samples", job.samples_done()},
        {"spp", MeanSpp(job)},
        {"bad_samples", job.bad_samples()},
        {"rays", job.rays()},
        {"samples_per_second", PerSecond(job.samples_done(), job.render_seconds())},
        {"rays_per_second", PerSecond(job.rays(), job.render_seconds())},
        {"relmse", job.relmse()},
        {"image_relmse", OrNull(job.has_image_relmse(), job.image_relmse())},
        {"passes", PassesJson(job)},
        {"forecast", ForecastJson(job)},
        {"filter", FilterJson(job.filter())},
        {"workers", WorkersJson(job)},
        {"leases",
         {{"issued", job.leases_issued()},
          {"reissued", job.leases_reissued()},
          {"duplicate", job.results_duplicate()}}},
        {"ledger", LedgerJson(job)},
        {"restarts", job.restarts()},
        {"seconds",
         {{"check", facts.check},
          {"start", facts.start},
          {"upload", facts.upload},
          {"wait", wait},
          {"render", job.render_seconds()},
          {"planning", job.plan_seconds()},
          {"planning_filter", job.plan_filter_seconds()},
          {"merging", job.merge_seconds()},
          {"saving", job.save_seconds()},
          {"filter", job.filter().seconds()},
          {"fetch", facts.fetch},
          {"total", facts.total}}},
        {"image",
         {{"file", facts.output}, {"sha256", job.image_sha256()}, {"bytes", job.result_size()}}},
    };
}

}  // namespace relume::client

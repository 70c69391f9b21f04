#include "client/cli/prepare_job.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "client/cli/exit_codes.h"
#include "client/lib/user_name.h"
#include "core/base/error.h"
#include "proto/codec/budgets.h"
#include "proto/codec/codec.h"

namespace relume::client {
namespace {

std::optional<LookCamera> LookOf(const JobOptions& options) {
    if (!options.look_from && !options.look_at) {
        if (options.look_up || options.fov) {
            ThrowInvalidArgument(fmt::format("{} needs --look-from and --look-at",
                                             options.fov ? "--fov" : "--look-up"));
        }
        return std::nullopt;
    }
    if (!options.look_from || !options.look_at) {
        ThrowInvalidArgument(options.look_from ? "--look-from needs --look-at"
                                               : "--look-at needs --look-from");
    }
    if (!options.camera.empty()) {
        ThrowInvalidArgument("--camera and --look-from exclude each other; leave one out");
    }
    LookCamera look;
    look.from = *options.look_from;
    look.at = *options.look_at;
    look.up = options.look_up.value_or(look.up);
    look.fov = options.fov.value_or(look.fov);
    return look;
}

bool HasBudget(const BudgetOptions& budgets) {
    return budgets.spp || budgets.max_spp || budgets.target || budgets.time_limit;
}

// What the scene file itself asks for, where the user does not; answers with what was taken.
std::vector<std::string> TakeHints(const RenderHints& hints, const JobOptions& options,
                                   RenderSettings* settings, BudgetOptions* budgets) {
    std::vector<std::string> taken;
    if (!options.size && hints.width > 0 && hints.height > 0) {
        settings->width = hints.width;
        settings->height = hints.height;
        taken.push_back(fmt::format("size {}x{}", hints.width, hints.height));
    }
    if (!options.max_depth && hints.max_depth > 0) {
        settings->max_depth = std::min(hints.max_depth, kMaxDepth);
        taken.push_back(fmt::format("max depth {}", settings->max_depth));
    }
    if (!HasBudget(*budgets) && hints.spp > 0) {
        budgets->spp = std::min(static_cast<double>(hints.spp), codec::kMaxSpp);
        taken.push_back(fmt::format("spp {}", *budgets->spp));
    }
    return taken;
}

// Answers with what is worth a note.
std::optional<std::string> TakeDefault(const std::string& sampler, BudgetOptions* budgets) {
    if (HasBudget(*budgets)) {
        return std::nullopt;
    }
    if (sampler.substr(0, sampler.find(':')) != "adaptive") {
        budgets->spp = kDefaultSpp;
        return std::nullopt;
    }
    budgets->target = kDefaultTarget;
    return fmt::format("without a budget: until the estimated RelMSE is {} everywhere",
                       kDefaultTarget);
}

void SetBudgets(const BudgetOptions& budgets, v1::JobSpec* spec) {
    spec->set_spp(budgets.spp.value_or(0));
    if (budgets.min_spp) {
        spec->set_min_spp(*budgets.min_spp);
    }
    if (budgets.max_spp) {
        spec->set_max_spp(*budgets.max_spp);
    }
    if (budgets.target) {
        spec->set_target(*budgets.target);
    }
    if (budgets.time_limit) {
        spec->set_time_limit(*budgets.time_limit);
    }
    WithExitCode(kExitUsage, [&] { codec::CheckBudgets(*spec); });
}

}  // namespace

PreparedJob PrepareJob(const JobOptions& options) {
    PreparedJob job;
    RenderSettings settings;
    settings.crop = options.crop;
    settings.seed = options.seed;
    settings.max_depth = options.max_depth.value_or(settings.max_depth);
    settings.camera = options.camera;
    WithExitCode(kExitUsage, [&] { settings.look = LookOf(options); });
    settings.lens_radius = options.lens_radius.value_or(-1);
    settings.focus_distance = options.focus_distance.value_or(-1);
    settings.time = options.time.value_or(-1);
    settings.shutter = options.shutter.value_or(-1);
    settings.environment_scale = options.environment_scale;
    settings.allow_black = options.allow_black;
    BudgetOptions budgets = options.budgets;

    WithExitCode(kExitInput, [&] {
        job.scene = CollectScene(options.scene, options.environment);
        const Scene scene = LoadForChecks(job.scene, settings);
        if (options.strict) {
            RequireNoNotes(scene);
        }
        job.notes = CheckScene(scene, settings);
        job.animation_seconds = static_cast<double>(scene.hints.animation_seconds);
        if (options.size) {
            settings.width = options.size->width;
            settings.height = options.size->height;
        } else {
            SetDefaultSize(settings.look ? nullptr : FindCamera(scene, options.camera), &settings);
        }
        const auto taken = TakeHints(scene.hints, options, &settings, &budgets);
        if (!taken.empty()) {
            job.notes.push_back(fmt::format("as the scene file says: {}", fmt::join(taken, ", ")));
        }
        if (const auto note = TakeDefault(options.sampler, &budgets)) {
            job.notes.push_back(*note);
        }
    });
    settings.environment = job.scene.environment;
    WithExitCode(kExitUsage, [&] { ValidateSettings(settings); });

    *job.spec.mutable_scene() = codec::ToProto(job.scene.manifest);
    *job.spec.mutable_settings() = codec::ToProto(settings);
    job.spec.set_sampler(options.sampler);
    job.spec.set_filter(options.filter);
    SetBudgets(budgets, &job.spec);
    job.spec.set_tile_size(options.tile_size);
    job.spec.set_all_layers(options.layers == "all");
    job.spec.set_keep_samples(options.keep_samples);
    job.spec.set_display_name(options.name);
    job.spec.set_priority(options.priority);
    job.spec.set_owner(options.owner.empty() ? UserAtHost() : options.owner);
    return job;
}

}  // namespace relume::client

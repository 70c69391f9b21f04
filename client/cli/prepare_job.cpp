#include "client/cli/prepare_job.h"

#include "client/cli/exit_codes.h"
#include "proto/codec/codec.h"

namespace relume::client {

PreparedJob PrepareJob(const JobOptions& options) {
    PreparedJob job;
    RenderSettings settings;
    settings.crop = options.crop;
    settings.seed = options.seed;
    settings.max_depth = options.max_depth;
    settings.camera = options.camera;
    settings.lens_radius = options.lens_radius.value_or(-1);
    settings.focus_distance = options.focus_distance.value_or(-1);
    settings.environment_scale = options.environment_scale;
    settings.allow_black = options.allow_black;

    WithExitCode(kExitInput, [&] {
        job.scene = CollectScene(options.scene, options.environment);
        const Scene scene = LoadForChecks(job.scene, options.environment_scale);
        job.notes = CheckScene(scene, settings);
        if (options.size) {
            settings.width = options.size->width;
            settings.height = options.size->height;
        } else {
            SetDefaultSize(FindCamera(scene, options.camera), &settings);
        }
    });
    settings.environment = job.scene.environment;
    WithExitCode(kExitUsage, [&] { ValidateSettings(settings); });

    *job.spec.mutable_scene() = codec::ToProto(job.scene.manifest);
    *job.spec.mutable_settings() = codec::ToProto(settings);
    job.spec.set_sampler(options.sampler);
    job.spec.set_filter(options.filter);
    job.spec.set_spp(options.spp);
    job.spec.set_tile_size(options.tile_size);
    job.spec.set_all_layers(options.layers == "all");
    job.spec.set_display_name(options.name);
    return job;
}

}  // namespace relume::client

#include "tests/fuzz/message_seeds.h"

#include "proto/codec/codec.h"
#include "relume/v1/jobs.pb.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::test {

std::vector<CodecSeed> CodecSeeds() {
    std::vector<CodecSeed> seeds;
    const SceneManifest manifest{
        "scene.gltf",
        {{"scene.gltf", 5, std::string(64, 'a')}, {"b.bin", 7, std::string(64, 'b')}}};
    RenderSettings settings;
    settings.width = 48;
    settings.height = 40;
    settings.look.emplace();
    const TileTask task{{4, 2, 7, 4}, {0, 1, 2, 3, 4, 5}, {4, 5, 0, 7, 64, 1}};
    seeds.push_back({0, std::make_unique<v1::SceneManifest>(codec::ToProto(manifest))});
    seeds.push_back({1, std::make_unique<v1::RenderSettings>(codec::ToProto(settings))});
    auto lease = std::make_unique<v1::Lease>();
    codec::TaskToLease(task, lease.get());
    seeds.push_back({2, std::move(lease)});
    auto result = std::make_unique<v1::LeaseResult>();
    result->set_planes(codec::EncodePlanes(PseudoRender(task)));
    result->set_seconds(0.5);
    result->set_rays(7);
    seeds.push_back({3, std::move(result)});
    auto samples = std::make_unique<v1::SampleChunk>();
    samples->set_data(std::string(task.TotalSamples() * sizeof(SampleRecord), '\0'));
    seeds.push_back({4, std::move(samples)});
    auto spec = std::make_unique<v1::JobSpec>();
    *spec->mutable_scene() = codec::ToProto(manifest);
    *spec->mutable_settings() = codec::ToProto(settings);
    spec->set_spp(8);
    seeds.push_back({5, std::move(spec)});
    return seeds;
}

std::vector<std::unique_ptr<google::protobuf::Message>> WorkSeeds() {
    std::vector<std::unique_ptr<google::protobuf::Message>> seeds;
    const auto add = [&] {
        seeds.push_back(std::make_unique<v1::WorkRequest>());
        return static_cast<v1::WorkRequest*>(seeds.back().get());
    };
    add()->mutable_report()->set_credits(3);
    auto* ready = add()->mutable_scene_ready();
    ready->set_job("jobs/a");
    ready->add_notes("a note");
    // The first leases are these tiles, of eight samples in all passes together.
    for (int id = 1; id <= 6; ++id) {
        for (const std::uint32_t count : {4u, 8u}) {
            TileTask task;
            const int x = 8 * ((id - 1) % 3), y = 8 * ((id - 1) / 3);
            task.rect = {x, y, x + 8, y + 8};
            task.first.assign(64, 0);
            task.count.assign(64, count);
            auto* result = add()->mutable_result();
            result->set_lease_id(static_cast<std::uint64_t>(id));
            result->set_job("jobs/a");
            result->set_planes(codec::EncodePlanes(PseudoRender(task)));
            result->set_seconds(0.01);
            result->set_rays(7);
        }
    }
    add()->mutable_lease_return()->add_lease_ids(2);
    auto* problem = add()->mutable_problem();
    problem->set_job("jobs/a");
    problem->set_message("a problem");
    return seeds;
}

}  // namespace relume::test

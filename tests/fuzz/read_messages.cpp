#include "tests/fuzz/read_messages.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/sha256.h"
#include "core/film/film.h"
#include "proto/codec/budgets.h"
#include "proto/codec/codec.h"
#include "proto/codec/digests.h"
#include "relume/v1/jobs.pb.h"
#include "relume/v1/work.pb.h"
#include "server/jobs/check_result.h"
#include "server/jobs/job_queue.h"
#include "server/rpc/job_spec.h"
#include "tests/unit/jobs/pseudo_renderer.h"

namespace relume::test {
namespace {

void Promise(bool kept, const char* what) {
    if (!kept) {
        throw std::logic_error(what);
    }
}

template <typename Message>
std::optional<Message> Parse(std::string_view bytes) {
    Message message;
    return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))
               ? std::optional(message)
               : std::nullopt;
}

// --- codec

void ReadManifest(const v1::SceneManifest& message) {
    const SceneManifest manifest = codec::FromProto(message);
    for (const ManifestEntry& entry : manifest.entries) {
        Promise(IsSafeRelativePath(entry.path), "a path leads out of the folder");
        Promise(entry.path.find('\n') == std::string::npos, "a path may pretend to be two");
    }
    Promise(ManifestDigest(codec::FromProto(codec::ToProto(manifest))) == ManifestDigest(manifest),
            "a manifest changes on its way");
}

void ReadSettings(const v1::RenderSettings& message) {
    const RenderSettings settings = codec::FromProto(message);
    const TileRect window = settings.Window();
    Promise(!window.empty() && window.area() <= static_cast<std::size_t>(kMaxImagePixels),
            "an image of no size");
    const SceneManifest manifest;
    Promise(codec::ContextDigest("", manifest, settings) ==
                codec::ContextDigest("", manifest, codec::FromProto(codec::ToProto(settings))),
            "settings change on their way");
}

void ReadLease(const v1::Lease& message) {
    const TileTask task = codec::TaskFromLease(message);
    Promise(task.first.size() == task.rect.area() && task.count.size() == task.rect.area(),
            "a task of another size");
    v1::Lease again;
    codec::TaskToLease(task, &again);
    Promise(codec::TaskDigest(1, 2, task) == codec::TaskDigest(1, 2, codec::TaskFromLease(again)),
            "a task changes on its way");
}

TileTask SmallTask(bool keep_samples) {
    return {{4, 2, 7, 4}, {0, 1, 2, 3, 4, 5}, {4, 5, 0, 7, 64, 1}, keep_samples};
}

// With checksums made right: else nothing would get further.
void ReadResult(const v1::LeaseResult& message) {
    const TileTask task = SmallTask(false);
    TileResult tile = codec::DecodePlanes(task, message.planes());
    tile.rays = message.rays();
    tile.seconds = message.seconds();
    v1::LeaseResult sealed = message;
    codec::SetDigests(codec::TaskDigest(1, 2, task), tile, &sealed);
    codec::CheckTaskDigest(codec::TaskDigest(1, 2, task), sealed);
    codec::CheckChecksum(tile, sealed);
    jobs::CheckResult(task, tile);
    for (const float value : tile.planes) {
        Promise(std::isfinite(value), "a value that is none is let in");
    }
    Promise(tile.seconds >= 0 && tile.seconds < 1e7, "a time that is none is let in");
    Film film({0, 0, 8, 8}, 8, 8);
    film.Merge(tile);
}

void ReadSamples(const v1::SampleChunk& message) {
    const TileTask task = SmallTask(true);
    Promise(codec::DecodeSamples(task, message.data()).size() == task.TotalSamples(),
            "samples of another number");
}

template <typename Message>
void With(std::string_view bytes, void (*read)(const Message&)) {
    if (const auto message = Parse<Message>(bytes)) {
        read(*message);
    }
}

void ReadCodec(std::string_view bytes) {
    if (bytes.empty()) {
        return;
    }
    const int kind = static_cast<unsigned char>(bytes.front()) % 6;
    bytes.remove_prefix(1);
    switch (kind) {
        case 0:
            return With<v1::SceneManifest>(bytes, ReadManifest);
        case 1:
            return With<v1::RenderSettings>(bytes, ReadSettings);
        case 2:
            return With<v1::Lease>(bytes, ReadLease);
        case 3:
            return With<v1::LeaseResult>(bytes, ReadResult);
        case 4:
            return With<v1::SampleChunk>(bytes, ReadSamples);
        default:
            return With<v1::JobSpec>(
                bytes, +[](const v1::JobSpec& spec) { codec::CheckBudgets(spec); });
    }
}

// --- spec

const store::BlobStore& Blobs() {
    static const TemporaryFolder folder;
    static store::BlobStore blobs(folder.path(), 1 << 20);
    static const bool filled = [] {
        const std::string scene = "scene";
        const auto upload = blobs.Begin(Sha256Hex(scene), scene.size(), 0);
        upload->Append(scene);
        upload->Commit();
        return true;
    }();
    Promise(filled, "no blob");
    return blobs;
}

void ReadSpec(std::string_view bytes) {
    auto spec = Parse<v1::JobSpec>(bytes);
    if (!spec) {
        return;
    }
    // Whatever files it names are there.
    for (v1::ManifestEntry& entry : *spec->mutable_scene()->mutable_entries()) {
        entry.set_sha256(Sha256Hex("scene"));
        entry.set_size(5);
    }
    const server::CheckedSpec checked = server::CheckSpec(*spec, Blobs());
    const jobs::JobSetup setup = checked.Setup();
    Promise(setup.planner != nullptr && !setup.window.empty() && setup.tile_size >= 8,
            "a job that can't be");
    Promise(!checked.budgets.samples || *checked.budgets.samples > 0, "a job of no samples");
}

// --- work

// A queue with one job of 24x16 pixels, its workers and what they have on loan.
class Farm {
  public:
    Farm() {
        jobs::JobSetup setup;
        setup.window = {0, 0, 24, 16};
        setup.display_width = 24;
        setup.display_height = 16;
        setup.tile_size = 8;
        setup.budgets.samples = 24 * 16 * 8;
        setup.planner = jobs::MakePlanner("uniform");
        queue_.AddJob(kJob, std::move(setup), now_);
        hostile_ = queue_.AddWorker("hostile", "class", 2, now_);
        honest_ = queue_.AddWorker("honest", "class", 1, now_);
        queue_.SetCredits(hostile_, 3, 0);
        LendTo(hostile_);
    }

    void Hear(const v1::WorkRequest& message) {
        now_ += std::chrono::milliseconds(100);
        queue_.Tick(now_);
        queue_.Heard(hostile_, now_);
        switch (message.message_case()) {
            case v1::WorkRequest::kReport:
                queue_.SetCredits(hostile_, message.report().credits() % 8,
                                  message.report().leases_held());
                break;
            case v1::WorkRequest::kResult:
                HearResult(message.result());
                break;
            case v1::WorkRequest::kLeaseReturn: {
                const auto& ids = message.lease_return().lease_ids();
                queue_.ReturnLeases(hostile_, {ids.begin(), ids.end()});
                break;
            }
            case v1::WorkRequest::kProblem:
                // One that is not transient ends the job, as it should.
                queue_.Problem(hostile_, message.problem().job(), message.problem().message(), true,
                               now_);
                break;
            case v1::WorkRequest::kSceneReady: {
                const auto& notes = message.scene_ready().notes();
                queue_.SceneReady(hostile_, message.scene_ready().job(),
                                  {notes.begin(), notes.end()}, now_);
                break;
            }
            default:
                break;
        }
        LendTo(hostile_);
    }

    // The honest one does the rest. Answers with the film, or nothing if the job has failed.
    std::shared_ptr<const Film> Finish() {
        queue_.RemoveWorker(hostile_);
        queue_.SetCredits(honest_, 64, 0);
        for (int rounds = 0; queue_.Get(kJob).state != jobs::JobState::kFiltering; ++rounds) {
            Promise(rounds < 10'000, "the job comes to no end");
            if (jobs::IsOver(queue_.Get(kJob).state)) {
                return nullptr;
            }
            now_ += std::chrono::milliseconds(100);
            queue_.Heard(honest_, now_);
            queue_.Tick(now_);
            for (const jobs::LeaseGrant& grant : LendTo(honest_)) {
                queue_.AddResult(honest_, grant.id, grant.job, PseudoRender(grant.task), now_);
            }
        }
        auto work = queue_.TakeFilterWork();
        Promise(work.has_value(), "no image to filter");
        return work->film;
    }

  private:
    static constexpr const char* kJob = "jobs/a";

    std::vector<jobs::LeaseGrant> LendTo(jobs::WorkerId worker) {
        std::vector<jobs::LeaseGrant> grants;
        for (;;) {
            while (auto work = queue_.TakePlanWork(now_)) {
                queue_.Planned(work->name, jobs::RunPlan(*work), now_);
            }
            const auto grant = queue_.NextLease(worker, now_);
            if (!grant) {
                queue_.TakeRevoked(worker);
                return grants;
            }
            grants.push_back(*grant);
        }
    }
    // As WorkSession hears it, with checksums that are right. What it lets in must not change the
    // image that the test expects, so the planes are made the right ones then.
    void HearResult(const v1::LeaseResult& result) {
        const jobs::LeaseId id = result.lease_id() % 64;
        const TileTask* task = queue_.TaskOf(id);
        try {
            TileResult tile;
            if (task != nullptr) {
                tile = codec::DecodePlanes(*task, result.planes());
                tile.rays = result.rays();
                tile.seconds = result.seconds();
                jobs::CheckResult(*task, tile);
                tile.planes = PseudoRender(*task).planes;
            }
            queue_.AddResult(hostile_, id, result.job(), std::move(tile), now_);
        } catch (const Error& error) {
            queue_.RejectResult(hostile_, id, error.what(), now_);
        }
    }

    jobs::JobQueue queue_;
    TimePoint now_{};
    jobs::WorkerId hostile_ = 0, honest_ = 0;
};

std::string DigestOf(const Film& film) {
    Sha256 sha;
    for (int channel = 0; channel < kFilmChannelCount; ++channel) {
        const auto plane = film.Plane(channel);
        sha.Update({reinterpret_cast<const char*>(plane.data()), plane.size_bytes()});
    }
    return sha.HexDigest();
}

void ReadWork(std::string_view bytes) {
    static const std::string due = DigestOf(*Farm().Finish());
    Farm farm;
    while (bytes.size() >= 4) {
        std::uint32_t size = 0;
        std::memcpy(&size, bytes.data(), 4);
        bytes.remove_prefix(4);
        const std::string_view part = bytes.substr(0, size);
        bytes.remove_prefix(part.size());
        if (const auto message = Parse<v1::WorkRequest>(part)) {
            farm.Hear(*message);
        }
    }
    if (const auto film = farm.Finish()) {
        Promise(DigestOf(*film) == due, "a worker has changed the image of others");
    }
}

}  // namespace

void ReadMessages(const std::string& kind, std::string_view bytes) {
    try {
        if (kind == "codec") {
            ReadCodec(bytes);
        } else if (kind == "spec") {
            ReadSpec(bytes);
        } else {
            ReadWork(bytes);
        }
    } catch (const Error&) {
    }
}

}  // namespace relume::test

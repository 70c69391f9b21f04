#pragma once

#include <cstdint>
#include <string>

#include "core/film/tile.h"
#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"
#include "relume/v1/work.pb.h"

namespace relume::codec {

// What both ends compute of a lease and its answer, each of what it holds itself, so that a bit
// that changed on the way is found. 0 stands for none: it is never made.

// Of a JobContext as it was understood.
std::uint64_t ContextDigest(const std::string& job, const SceneManifest& manifest,
                            const RenderSettings& settings);
// Of a lease as it was understood, within its job's context.
std::uint64_t TaskDigest(std::uint64_t context, std::uint64_t unit, const TileTask& task);
// Of a result: planes, samples, rays and seconds.
std::uint64_t ResultChecksum(const TileResult& result);

// The fields task_digest and checksum of an answer.
void SetDigests(std::uint64_t task_digest, const TileResult& result, v1::LeaseResult* message);
// Each throws kDataLoss if it is not: the answer to the task of that digest; what was sent, with
// `result` read from it.
void CheckTaskDigest(std::uint64_t due, const v1::LeaseResult& message);
void CheckChecksum(const TileResult& result, const v1::LeaseResult& message);

}  // namespace relume::codec

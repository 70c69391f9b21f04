#pragma once

#include <string>
#include <vector>

#include "core/film/tile.h"
#include "core/scene/manifest.h"
#include "core/scene/render_settings.h"
#include "relume/v1/types.pb.h"
#include "relume/v1/work.pb.h"

namespace relume::codec {

// Conversions between messages and core types, nothing else. FromProto throws kInvalidArgument on
// anything that is malformed, so that whatever it returns can be used without another check of its
// shape.

v1::TileRect ToProto(const TileRect& rect);
TileRect FromProto(const v1::TileRect& rect);

v1::RenderSettings ToProto(const RenderSettings& settings);
RenderSettings FromProto(const v1::RenderSettings& settings);  // validated, defaults filled in

v1::SceneManifest ToProto(const SceneManifest& manifest);
SceneManifest FromProto(const v1::SceneManifest& manifest);  // validated

// Fills rect, first_sample, sample_count and keep_samples; a value that all pixels share is sent
// once.
void TaskToLease(const TileTask& task, v1::Lease* lease);
// Throws unless the tile is at most kMaxTileSide a side.
TileTask TaskFromLease(const v1::Lease& lease);

inline constexpr int kMaxTileSide = 64;  // 64 x 64 x 160 B keeps a result under 1 MiB
inline constexpr std::size_t kMaxChunk = std::size_t{1} << 20;

// The planes of a result as little-endian float32. The shape follows from the lease.
std::string EncodePlanes(const TileResult& result);
// The result of `task` from planes; throws if the size is not the task's.
TileResult DecodePlanes(const TileTask& task, const std::string& planes);

// The samples of a result as little-endian float32, in parts of at most kMaxChunk; empty if it has
// none.
std::vector<std::string> EncodeSamples(const TileResult& result);
// Bytes of the samples of `task`; 0 if it is to keep none.
std::size_t SampleBytes(const TileTask& task);
// All parts in one; throws if the size is not the task's.
std::vector<SampleRecord> DecodeSamples(const TileTask& task, const std::string& bytes);

}  // namespace relume::codec

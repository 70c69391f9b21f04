#include "server/rpc/saved_film.h"

#include <memory>
#include <vector>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/film/film.h"
#include "proto/codec/protocol.h"
#include "server/rpc/saved_info.h"

namespace relume::server {
namespace {

constexpr const char* kFormat = "relume film 2";

}  // namespace

std::string FilmHeader(const jobs::Checkpoint& checkpoint) {
    ByteWriter header;
    header.PutText(kFormat);
    header.PutText(kBuild);
    header.Put(checkpoint.window);
    header.Put(checkpoint.display_width);
    header.Put(checkpoint.display_height);
    header.Put(checkpoint.tile_size);
    return header.Take();
}

jobs::SavedJob ReadSavedFilm(const store::SnapshotStore& store, const store::SnapshotFile& file,
                             double used_seconds, const WallClock& wall, TimePoint now) {
    jobs::SavedJob saved;
    std::vector<TileRect> tiles;
    std::size_t records = 0;
    store.Read(file, [&](std::string record) {
        ByteReader in(record);
        const std::size_t at = records++;
        if (at == 0) {
            if (in.GetText() != kFormat || in.GetText() != kBuild) {
                throw Error(ErrorCode::kDataLoss, file.name +
                                                      ": was written by another version, whose "
                                                      "samples may differ");
            }
            const auto window = in.Get<TileRect>();
            const auto display_width = in.Get<int>(), display_height = in.Get<int>();
            const auto tile_size = in.Get<int>();
            // Before so much room is made.
            if (window.empty() || tile_size <= 0 || window.area() > file.size / sizeof(float)) {
                throw Error(ErrorCode::kDataLoss, file.name + ": is damaged");
            }
            tiles = CutIntoTiles(window, tile_size);
            saved.film = std::make_shared<Film>(window, display_width, display_height);
        } else if (at <= tiles.size()) {
            const auto tile = in.Get<std::uint64_t>();
            if (tile >= tiles.size()) {
                throw Error(ErrorCode::kDataLoss, file.name + ": is damaged");
            }
            saved.film->LoadTile(tiles[tile], in.GetText());
        } else if (at == tiles.size() + 1) {
            saved.info = LoadInfo(record, used_seconds, wall, now);
        } else {
            saved.checkpoint = jobs::DecodeCheckpoint(record);
        }
    });
    if (records != tiles.size() + 3) {
        throw Error(ErrorCode::kDataLoss, file.name + ": lacks tiles");
    }
    return saved;
}

}  // namespace relume::server

#include "server/jobs/checkpoint.h"

#include "core/base/byte_stream.h"

namespace relume::jobs {
namespace {

template <typename T>
std::shared_ptr<const std::vector<T>> GetShared(ByteReader* in) {
    return std::make_shared<const std::vector<T>>(in->GetAll<T>());
}

}  // namespace

std::string EncodeCheckpoint(const Checkpoint& c) {
    ByteWriter out;
    out.Put(c.window);
    out.Put(c.display_width);
    out.Put(c.display_height);
    out.Put(c.tile_size);
    out.Put(c.passes_planned);
    out.Put(c.units_planned);
    out.Put(c.samples_planned);
    out.Put<std::uint8_t>(c.stop ? 1 : 0);
    if (c.stop) {
        out.Put(c.stop->reason);
        out.PutText(c.stop->words);
    }
    out.PutAll(c.errors);
    out.PutAll(c.tile_error);
    out.PutText(c.planner);
    out.PutAll(*c.planned);
    out.PutAll(*c.selector);
    out.PutAll(*c.decisions);
    out.Put<std::uint64_t>(c.open.size());
    for (const OpenPassState& open : c.open) {
        open.plan->first.Put(&out);
        open.plan->counts.Put(&out);
        open.plan->cover.Put(&out);
        out.PutAll(open.merged);
        out.PutAll(open.error);
        out.Put(open.plan_seconds);
        out.PutOptional(open.image_relmse);
        out.PutOptional(open.relmse_predicted);
    }
    return out.Take();
}

Checkpoint DecodeCheckpoint(std::string_view bytes) {
    ByteReader in(bytes);
    Checkpoint c;
    c.window = in.Get<TileRect>();
    c.display_width = in.Get<int>();
    c.display_height = in.Get<int>();
    c.tile_size = in.Get<int>();
    c.passes_planned = in.Get<std::uint32_t>();
    c.units_planned = in.Get<std::uint64_t>();
    c.samples_planned = in.Get<std::uint64_t>();
    if (in.Get<std::uint8_t>() != 0) {
        c.stop.emplace();
        c.stop->reason = in.Get<StopReason>();
        c.stop->words = in.GetText();
    }
    c.errors = in.GetAll<ErrorPoint>();
    c.tile_error = in.GetAll<double>();
    c.planner = in.GetText();
    c.planned = GetShared<std::uint32_t>(&in);
    c.selector = GetShared<float>(&in);
    c.decisions = GetShared<Decision>(&in);
    const auto open = in.Get<std::uint64_t>();
    for (std::uint64_t i = 0; i < open; ++i) {
        OpenPassState state;
        const auto plan = std::make_shared<PassPlan>();
        plan->first = PixelCounts::Get(&in);
        plan->counts = PixelCounts::Get(&in);
        plan->cover = PixelCounts::Get(&in);
        state.plan = plan;
        state.merged = in.GetAll<std::uint32_t>();
        state.error = in.GetAll<double>();
        state.plan_seconds = in.Get<double>();
        state.image_relmse = in.GetOptional<double>();
        state.relmse_predicted = in.GetOptional<double>();
        c.open.push_back(std::move(state));
    }
    in.End();
    return c;
}

}  // namespace relume::jobs

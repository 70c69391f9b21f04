// Many samples at a few random pixels and none elsewhere: what `relume verify` judges an image by.
//
//   pixels   how many (default 1024); all, if the image has no more
//   spp      samples of each; even (default 256), less if the budget is smaller
//   salt     another number, other pixels (default 0)
//
// The pixels are those with the smallest hashes of salt and place: every set of that many is as
// likely, and none comes twice. All samples are one pass.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/base/byte_stream.h"
#include "core/base/error.h"
#include "core/base/param_set.h"
#include "server/jobs/planner.h"

namespace relume::jobs {
namespace {

constexpr int kMost = 1'000'000;  // ParamSet's

// The finaliser of splitmix64 (Steele, Lea, Flood 2014): a bijection.
std::uint64_t Mix(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

class Probe final : public Planner {
  public:
    explicit Probe(const ParamSet& params)
        : pixels_(params.GetInt("pixels", 1024)),
          spp_(params.GetInt("spp", 256)),
          salt_(params.GetInt("salt", 0)) {
        const auto require = [](bool good, const char* name, int value, const char* range) {
            if (!good) {
                ThrowInvalidArgument(fmt::format("sampler 'probe': {}={} must be {} to {}", name,
                                                 value, range, kMost));
            }
        };
        require(pixels_ >= 1 && pixels_ <= kMost, "pixels", pixels_, "1");
        require(spp_ >= 2 && spp_ <= kMost && spp_ % 2 == 0, "spp", spp_, "even and 2");
        require(salt_ >= 0 && salt_ <= kMost, "salt", salt_, "0");
    }

    std::string Describe() const override {
        return fmt::format("probe:pixels={},spp={},salt={}", pixels_, spp_, salt_);
    }

    FilmView View() const override { return FilmView::kNothing; }

    Plan NextPass(const PlanInput& input) override {
        if (planned_) {
            return {{}, "every probed pixel has its samples", {}, {}};
        }
        planned_ = true;
        const std::size_t all = input.film.pixel_count();
        const std::size_t pixels = std::min(all, static_cast<std::size_t>(pixels_));
        const std::uint64_t spp = std::min<std::uint64_t>(static_cast<std::uint64_t>(spp_),
                                                          input.budget / pixels / 2 * 2);
        if (spp == 0) {
            return {{}, kBudgetSpent, {}, {}};
        }
        std::vector<std::uint64_t> keys(all);
        const std::uint64_t salt = Mix(static_cast<std::uint64_t>(salt_));
        for (std::size_t i = 0; i < all; ++i) {
            keys[i] = Mix(salt + i);  // a bijection: no two are equal
        }
        std::vector<std::uint32_t> order(all);
        std::iota(order.begin(), order.end(), 0u);
        const auto end = order.begin() + static_cast<std::ptrdiff_t>(pixels);
        if (pixels < all) {
            std::nth_element(order.begin(), end, order.end(),
                             [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
        }
        Plan plan;
        plan.counts.assign(all, 0);
        for (auto it = order.begin(); it != end; ++it) {
            plan.counts[*it] = static_cast<std::uint32_t>(spp);
        }
        return plan;
    }

    std::string Save() const override {
        ByteWriter out;
        out.Put(planned_);
        return out.Take();
    }
    void Restore(std::string_view bytes) override {
        ByteReader in(bytes);
        planned_ = in.Get<bool>();
        in.End();
    }

  private:
    int pixels_, spp_, salt_;
    bool planned_ = false;
};

}  // namespace

std::unique_ptr<Planner> MakeProbe(const ParamSet& params) {
    return std::make_unique<Probe>(params);
}

}  // namespace relume::jobs

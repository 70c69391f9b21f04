#include "server/denoise/rd_filter.h"

#include <algorithm>
#include <memory>

#include "core/base/check.h"

namespace relume::denoise {
namespace {

constexpr int kWidth = 64, kHeight = 32;  // of a tile
constexpr int kArea = kWidth * kHeight;
constexpr float kFeatureSigma = 0.6f;  // k_f
constexpr float kEpsilon = 1e-10f;
constexpr float kNudge = 1.01f;  // the pixel's own value, for the derivative
constexpr float kLeastOwnWeight = 1e-3f;

// Sums of one filter over a tile.
class Sums {
  public:
    explicit Sums(int inputs) : inputs_(inputs), data_(static_cast<std::size_t>(kPlanes * kArea)) {}

    void Clear() { std::ranges::fill(data_, 0.0f); }
    RdSums View(bool squares, bool nudged) {
        RdSums view{};
        view.weight = At(0);
        view.largest = At(1);
        for (int k = 0; k < inputs_; ++k) {
            view.sum[k] = At(2 + k);
        }
        view.squares = squares ? At(13) : nullptr;
        if (nudged) {
            view.nudged_weight = At(8);
            view.nudged_largest = At(9);
            for (int c = 0; c < 3; ++c) {
                view.nudged_sum[c] = At(10 + c);
            }
        }
        view.stride = kWidth;
        return view;
    }

  private:
    static constexpr int kPlanes = 14;

    float* At(int plane) { return data_.data() + plane * kArea; }

    int inputs_;
    std::vector<float> data_;
};

// Everything that one thread needs.
class Worker {
  public:
    Worker(const RdScene& scene, std::span<const RdFilter> filters, const NlmKernels& kernels)
        : scene_(scene),
          filters_(filters),
          kernels_(RdKernelsFor(kernels)),
          offsets_(HalfWindow(scene.radius)) {
        for (const RdFilter& filter : filters) {
            sums_.emplace_back(static_cast<int>(scene.in.size()));
            const auto known = std::ranges::find(taus_, filter.tau);
            floor_of_.push_back(static_cast<std::size_t>(known - taus_.begin()));
            if (known == taus_.end()) {
                taus_.push_back(filter.tau);
            }
            if (filter.color) {
                NlmOptions options = *filter.color;
                options.symmetric = true;
                weights_.push_back(
                    std::make_unique<NlmWeights>(options, scene.radius, kWidth, kHeight, kernels));
            } else {
                weights_.push_back(nullptr);
            }
        }
        const HaloPlane plane(kWidth, kHeight, scene.radius);
        in_.assign(scene.in.size(), plane);
        features_.assign(3 * scene.features.value.size(), plane);
        RELUME_CHECK(taus_.size() <= kRdFloors);
        feature_distance_.resize(taus_.size() * kNlmDirections * kArea);
    }

    void Filter(const TileRect& tile, std::vector<RdFiltered>* out) {
        Load(tile);
        for (const auto& [dx, dy] : offsets_) {
            ComputeFeatureDistances(tile, dx, dy);
            for (std::size_t k = 0; k < filters_.size(); ++k) {
                Gather(tile, k, dx, dy);
            }
        }
        for (std::size_t k = 0; k < filters_.size(); ++k) {
            Finish(tile, k, &(*out)[k]);
        }
    }

  private:
    void Load(const TileRect& tile) {
        const int width = scene_.guide.width, height = scene_.guide.height;
        for (std::size_t k = 0; k < in_.size(); ++k) {
            in_[k].Load(*scene_.in[k], width, height, tile);
        }
        const std::size_t channels = scene_.features.value.size();
        for (std::size_t c = 0; c < channels; ++c) {
            features_[3 * c].Load(scene_.features.value[c], width, height, tile);
            features_[3 * c + 1].Load(scene_.features.variance[c], width, height, tile);
            features_[3 * c + 2].Load(scene_.features.spread[c], width, height, tile);
        }
        for (std::size_t k = 0; k < filters_.size(); ++k) {
            sums_[k].Clear();
            if (weights_[k]) {
                weights_[k]->Load(scene_.guide, tile);
            }
        }
    }

    void ComputeFeatureDistances(const TileRect& tile, int dx, int dy) {
        RdFeatures features{};
        features.groups = static_cast<int>(scene_.features.group_size.size());
        std::ranges::copy(scene_.features.group_size, features.size);
        for (std::size_t c = 0; c < scene_.features.value.size(); ++c) {
            features.value[c] = features_[3 * c].origin();
            features.variance[c] = features_[3 * c + 1].origin();
            features.spread[c] = features_[3 * c + 2].origin();
            features.stride = features_[0].stride();
        }
        features.shift = dy * features.stride + dx;
        features.k_squared = kFeatureSigma * kFeatureSigma;
        features.epsilon = kEpsilon;
        features.floors = static_cast<int>(taus_.size());
        features.distance_stride = kWidth;
        for (std::size_t t = 0; t < taus_.size(); ++t) {
            features.tau[t] = taus_[t];
            for (const NlmDirection d : {kForward, kBackward, kBetween}) {
                features.distance[t][d] = FeatureDistance(t, d);
            }
        }
        kernels_.features(features, tile.width(), tile.height());
        const int width = scene_.guide.width, height = scene_.guide.height;
        for (std::size_t t = 0; t < taus_.size(); ++t) {
            FillOutside(FeatureDistance(t, kForward), kWidth, tile,
                        PixelsWithNeighbour(width, height, dx, dy), kNlmOutside);
            FillOutside(FeatureDistance(t, kBackward), kWidth, tile,
                        PixelsWithNeighbour(width, height, -dx, -dy), kNlmOutside);
        }
    }

    float* FeatureDistance(std::size_t floor, NlmDirection direction) {
        return feature_distance_.data() +
               (floor * kNlmDirections + static_cast<std::size_t>(direction)) * kArea;
    }

    void Gather(const TileRect& tile, std::size_t k, int dx, int dy) {
        RdPair pair{};
        const bool nudged = scene_.with_sure && weights_[k];
        if (NlmWeights* weights = weights_[k].get()) {
            weights->ComputeDistances(dx, dy);
            pair.color[kForward] = weights->forward();
            pair.color[kBackward] = weights->backward();
            pair.color[kBetween] = weights->between();
            pair.color_stride = weights->stride();
            if (nudged) {
                weights->ComputeNudgedDistances(dx, dy, kNudge);
            }
            for (const NlmDirection d : {kForward, kBackward, kBetween}) {
                pair.nudged[d] = weights->nudged(d);
            }
        }
        for (const NlmDirection d : {kForward, kBackward, kBetween}) {
            pair.feature[d] = FeatureDistance(floor_of_[k], d);
        }
        pair.feature_stride = kWidth;
        pair.inputs = static_cast<int>(in_.size());
        for (std::size_t c = 0; c < in_.size(); ++c) {
            pair.in[c] = in_[c].origin();
        }
        pair.in_stride = in_[0].stride();
        pair.shift = dy * pair.in_stride + dx;
        kernels_.gather(pair, sums_[k].View(scene_.with_variance_share, nudged), tile.width(),
                        tile.height());
    }

    void Finish(const TileRect& tile, std::size_t k, RdFiltered* out) {
        const bool nudged = scene_.with_sure && weights_[k];
        const RdSums sums = sums_[k].View(scene_.with_variance_share, nudged);
        for (int y = 0; y < tile.height(); ++y) {
            const auto row = static_cast<std::size_t>(tile.y0 + y) *
                                 static_cast<std::size_t>(scene_.guide.width) +
                             static_cast<std::size_t>(tile.x0);
            for (int x = 0; x < tile.width(); ++x) {
                const std::size_t i = row + static_cast<std::size_t>(x);
                const int at = y * kWidth + x;
                const float own = std::max(sums.largest[at], kLeastOwnWeight);
                const float whole = sums.weight[at] + own;
                for (std::size_t c = 0; c < in_.size(); ++c) {
                    out->out[c][i] = (sums.sum[c][at] + own * (*scene_.in[c])[i]) / whole;
                }
                if (scene_.with_variance_share) {
                    out->variance_share[i] = (sums.squares[at] + own * own) / (whole * whole);
                }
                if (!scene_.with_sure) {
                    continue;
                }
                float error = 0, slope = 0;
                for (std::size_t c = 0; c < 3; ++c) {
                    const float y_i = (*scene_.in[c])[i], v = (*scene_.guide.variance[c])[i];
                    const float filtered = out->out[c][i];
                    float derivative = own / whole;
                    if (nudged) {
                        const float own_moved = std::max(sums.nudged_largest[at], kLeastOwnWeight);
                        const float moved = (sums.nudged_sum[c][at] + own_moved * kNudge * y_i) /
                                            (sums.nudged_weight[at] + own_moved);
                        const float step = (kNudge - 1) * y_i + kEpsilon;
                        const float measured = (moved - filtered) / step;
                        if (measured >= 0 && measured <= 1) {
                            derivative = measured;
                        }
                    }
                    const float residual = filtered - y_i;
                    error += residual * residual + v * (2 * derivative - 1);
                    slope += derivative;
                }
                out->sure[i] = error * (1.0f / 3.0f);
                out->derivative[i] = slope * (1.0f / 3.0f);
            }
        }
    }

    const RdScene& scene_;
    std::span<const RdFilter> filters_;
    const RdKernels& kernels_;
    std::vector<std::pair<int, int>> offsets_;
    std::vector<Sums> sums_;
    std::vector<std::unique_ptr<NlmWeights>> weights_;
    std::vector<HaloPlane> in_, features_;
    std::vector<float> taus_;              // those of the filters, each once
    std::vector<std::size_t> floor_of_;    // index into taus_
    std::vector<float> feature_distance_;  // directions of each tau
};

}  // namespace

std::vector<RdFiltered> ApplyRdFilters(const RdScene& scene, std::span<const RdFilter> filters,
                                       const CancelToken& cancel, const NlmKernels& kernels) {
    const std::size_t pixels =
        static_cast<std::size_t>(scene.guide.width) * static_cast<std::size_t>(scene.guide.height);
    std::vector<RdFiltered> out(filters.size());
    for (RdFiltered& filtered : out) {
        filtered.out.assign(scene.in.size(), Plane(pixels));
        if (scene.with_sure) {
            filtered.sure.resize(pixels);
            filtered.derivative.resize(pixels);
        }
        if (scene.with_variance_share) {
            filtered.variance_share.resize(pixels);
        }
    }
    ForTilesOf(scene.guide.width, scene.guide.height, kWidth, kHeight, cancel, [&]() -> TileBody {
        auto worker = std::make_shared<Worker>(scene, filters, kernels);
        return [worker, &out](const TileRect& tile) { worker->Filter(tile, &out); };
    });
    return out;
}

}  // namespace relume::denoise

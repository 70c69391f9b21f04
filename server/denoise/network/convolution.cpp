#include "server/denoise/network/convolution.h"

#include <algorithm>
#include <dnnl.hpp>
#include <mutex>
#include <string>
#include <utility>

#include "core/base/error.h"

// Of libgomp, which Debian's oneDNN runs its threads by. Declared here, as clang has its own omp.h.
extern "C" {
int omp_get_max_threads(void);
void omp_set_num_threads(int count);
}

namespace relume::denoise {
namespace {

// In its scope oneDNN takes the calling thread alone: threads are core/base/parallel.h's matter,
// and how oneDNN divides work among several may change the order of sums.
class OneThread {
  public:
    OneThread() : before_(omp_get_max_threads()) { omp_set_num_threads(1); }
    ~OneThread() { omp_set_num_threads(before_); }
    OneThread(const OneThread&) = delete;
    OneThread& operator=(const OneThread&) = delete;

  private:
    int before_;
};

const dnnl::engine& Cpu() {
    static const dnnl::engine engine(dnnl::engine::kind::cpu, 0);
    return engine;
}

template <typename F>
auto OrError(const F& f) {
    try {
        return f();
    } catch (const dnnl::error& error) {
        throw Error(ErrorCode::kInternal, std::string("oneDNN: ") + error.what());
    }
}

using Format = dnnl::memory::format_tag;
using Description = dnnl::convolution_forward::primitive_desc;
constexpr auto kFloat = dnnl::memory::data_type::f32;

Description Describe(const ConvolutionShape& s) {
    const auto pixels = ChannelLanes() == 16 ? Format::nChw16c : Format::nChw8c;
    const int more = s.kernel - 1;
    const dnnl::memory::desc from({1, s.inputs, s.rows + more, s.columns + more}, kFloat, pixels);
    const dnnl::memory::desc to({1, s.outputs, s.rows, s.columns}, kFloat, pixels);
    const dnnl::memory::desc weights({s.outputs, s.inputs, s.kernel, s.kernel}, kFloat,
                                     Format::any);
    const dnnl::memory::desc bias({s.outputs}, kFloat, Format::x);
    dnnl::primitive_attr attributes;
    attributes.set_scratchpad_mode(dnnl::scratchpad_mode::user);
    if (s.relu) {
        dnnl::post_ops after;
        after.append_eltwise(1, dnnl::algorithm::eltwise_relu, 0, 0);
        attributes.set_post_ops(after);
    }
    return {dnnl::convolution_forward::desc(dnnl::prop_kind::forward_inference,
                                            dnnl::algorithm::convolution_direct, from, weights,
                                            bias, to, {1, 1}, {0, 0}, {0, 0}),
            attributes, Cpu()};
}

}  // namespace

int ChannelLanes() { return std::max(VectorLanes(), 8); }

int VectorLanes() {
    // One bit a set of instructions.
    static const auto has = [](dnnl::cpu_isa instructions) {
        const auto bits = static_cast<unsigned>(instructions);
        return (static_cast<unsigned>(dnnl::get_effective_cpu_isa()) & bits) == bits;
    };
    static const int lanes = has(dnnl::cpu_isa::avx512_core) ? 16
                             : has(dnnl::cpu_isa::avx2)      ? 8
                                                             : 4;
    return lanes;
}

// Few layouts are asked for; of more, as an image of each size may want its own, the oldest go.
struct ConvolutionWeights::Impl {
    static constexpr std::size_t kMostLayouts = 4;

    std::vector<float> weights, bias;
    std::mutex mutex;
    std::vector<dnnl::memory> layouts;  // under mutex, the oldest first

    dnnl::memory InLayout(const ConvolutionShape& shape, const dnnl::memory::desc& layout) {
        const std::lock_guard lock(mutex);
        for (const dnnl::memory& made : layouts) {
            if (made.get_desc() == layout) {
                return made;
            }
        }
        // oneDNN does not write to what it reads.
        dnnl::memory plain(
            {{shape.outputs, shape.inputs, shape.kernel, shape.kernel}, kFloat, Format::oihw},
            Cpu(), weights.data());
        dnnl::memory made(layout, Cpu());
        dnnl::stream stream(Cpu());
        dnnl::reorder(plain, made).execute(stream, plain, made);
        stream.wait();
        if (layouts.size() == kMostLayouts) {
            layouts.erase(layouts.begin());
        }
        layouts.push_back(made);
        return made;
    }
};

ConvolutionWeights::ConvolutionWeights(std::vector<float> weights, std::vector<float> bias)
    : impl_(std::make_unique<Impl>()) {
    impl_->weights = std::move(weights);
    impl_->bias = std::move(bias);
}

ConvolutionWeights::~ConvolutionWeights() = default;
ConvolutionWeights::ConvolutionWeights(ConvolutionWeights&&) noexcept = default;
ConvolutionWeights& ConvolutionWeights::operator=(ConvolutionWeights&&) noexcept = default;

struct BlockConvolution::Impl {
    explicit Impl(const ConvolutionShape& shape)
        : description(Describe(shape)), convolution(description) {}

    Description description;
    dnnl::convolution_forward convolution;
    dnnl::memory weights, bias;
};

BlockConvolution::BlockConvolution(const ConvolutionShape& shape,
                                   const ConvolutionWeights& weights) {
    const OneThread one_thread;
    impl_ = OrError([&] {
        auto impl = std::make_unique<Impl>(shape);
        impl->weights = weights.impl_->InLayout(shape, impl->description.weights_desc());
        impl->bias = dnnl::memory(impl->description.bias_desc(), Cpu());
        std::copy(weights.impl_->bias.begin(), weights.impl_->bias.end(),
                  static_cast<float*>(impl->bias.get_data_handle()));
        return impl;
    });
}

BlockConvolution::~BlockConvolution() = default;
BlockConvolution::BlockConvolution(BlockConvolution&&) noexcept = default;
BlockConvolution& BlockConvolution::operator=(BlockConvolution&&) noexcept = default;

void BlockConvolution::Run(const float* from, float* to, std::vector<float>* scratch) const {
    const OneThread one_thread;
    OrError([&] {
        const Description& description = impl_->description;
        const auto scratch_description = description.scratchpad_desc();
        const std::size_t scratch_floats = scratch_description.get_size() / sizeof(float) + 1;
        if (scratch->size() < scratch_floats) {
            scratch->resize(scratch_floats);
        }
        dnnl::stream stream(Cpu());
        impl_->convolution.execute(
            stream,
            {{DNNL_ARG_SRC, dnnl::memory(description.src_desc(), Cpu(), const_cast<float*>(from))},
             {DNNL_ARG_WEIGHTS, impl_->weights},
             {DNNL_ARG_BIAS, impl_->bias},
             {DNNL_ARG_DST, dnnl::memory(description.dst_desc(), Cpu(), to)},
             {DNNL_ARG_SCRATCHPAD, dnnl::memory(scratch_description, Cpu(), scratch->data())}});
        stream.wait();
    });
}

}  // namespace relume::denoise

#include "server/denoise/network/convolution.h"

#include <dnnl.hpp>

#include <algorithm>
#include <string>

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
constexpr auto kFloat = dnnl::memory::data_type::f32;

dnnl::convolution_forward::primitive_desc Describe(const ConvolutionShape& s) {
    const int side = s.kernel / 2;
    // Channels are innermost, so that a band of rows is one piece.
    const dnnl::memory::desc from({1, s.inputs, s.rows + 2 * side, s.width}, kFloat, Format::nhwc);
    const dnnl::memory::desc to({1, s.outputs, s.rows, s.width}, kFloat, Format::nhwc);
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
                                            bias, to, {1, 1}, {0, side}, {0, side}),
            attributes, Cpu()};
}

}  // namespace

struct BandConvolution::Impl {
    explicit Impl(const ConvolutionShape& shape)
        : description(Describe(shape)),
          convolution(description),
          weights(description.weights_desc(), Cpu()),
          bias(description.bias_desc(), Cpu()) {}

    dnnl::convolution_forward::primitive_desc description;
    dnnl::convolution_forward convolution;
    dnnl::memory weights, bias;
};

BandConvolution::BandConvolution(const ConvolutionShape& shape, const std::vector<float>& weights,
                                 const std::vector<float>& bias) {
    const OneThread one_thread;
    impl_ = OrError([&] {
        auto impl = std::make_unique<Impl>(shape);
        dnnl::stream stream(Cpu());
        // oneDNN does not write to what it reads.
        dnnl::memory plain(
            {{shape.outputs, shape.inputs, shape.kernel, shape.kernel}, kFloat, Format::oihw},
            Cpu(), const_cast<float*>(weights.data()));
        dnnl::reorder(plain, impl->weights).execute(stream, plain, impl->weights);
        stream.wait();
        std::copy(bias.begin(), bias.end(), static_cast<float*>(impl->bias.get_data_handle()));
        return impl;
    });
}

BandConvolution::~BandConvolution() = default;
BandConvolution::BandConvolution(BandConvolution&&) noexcept = default;
BandConvolution& BandConvolution::operator=(BandConvolution&&) noexcept = default;

void BandConvolution::Run(const float* from, float* to) const {
    const OneThread one_thread;
    OrError([&] {
        const auto& description = impl_->description;
        dnnl::stream stream(Cpu());
        impl_->convolution.execute(
            stream,
            {{DNNL_ARG_SRC, dnnl::memory(description.src_desc(), Cpu(), const_cast<float*>(from))},
             {DNNL_ARG_WEIGHTS, impl_->weights},
             {DNNL_ARG_BIAS, impl_->bias},
             {DNNL_ARG_DST, dnnl::memory(description.dst_desc(), Cpu(), to)},
             {DNNL_ARG_SCRATCHPAD, dnnl::memory(description.scratchpad_desc(), Cpu())}});
        stream.wait();
    });
}

}  // namespace relume::denoise

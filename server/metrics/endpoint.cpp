#include "server/metrics/endpoint.h"

#include <fmt/format.h>
#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/metrics/families.h"

namespace relume::metrics {
namespace {

// A client that says nothing holds one of the threads for so long.
constexpr const char* kRequestMilliseconds = "2000";
constexpr const char* kThreads = "4";

}  // namespace

class Endpoint::Collector final : public prometheus::Collectable {
  public:
    explicit Collector(std::function<std::optional<FarmStatus>()> ask) : ask_(std::move(ask)) {}

    std::vector<prometheus::MetricFamily> Collect() const override { return MakeFamilies(ask_()); }

  private:
    std::function<std::optional<FarmStatus>()> ask_;
};

Endpoint::Endpoint(const std::string& address, std::function<std::optional<FarmStatus>()> ask)
    : collector_(std::make_shared<Collector>(std::move(ask))) {
    if (address.rfind('[', 0) == 0) {
        // Debian builds civetweb without it.
        ThrowInvalidArgument(
            fmt::format("--metrics {}: the page has no IPv6; give an IPv4 address", address));
    }
    try {
        exposer_ = std::make_unique<prometheus::Exposer>(
            std::vector<std::string>{"listening_ports", address, "num_threads", kThreads,
                                     "request_timeout_ms", kRequestMilliseconds});
        port_ = exposer_->GetListeningPorts().at(0);
    } catch (const std::exception&) {
        throw Error(ErrorCode::kUnavailable,
                    fmt::format("can't listen on {}: is the port taken, the host this machine's? "
                                "Choose another --metrics",
                                address));
    }
    exposer_->RegisterCollectable(collector_);
}

Endpoint::~Endpoint() = default;

}  // namespace relume::metrics

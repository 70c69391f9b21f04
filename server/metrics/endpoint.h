#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/metrics/farm_status.h"

namespace prometheus {
class Exposer;
}

namespace relume::metrics {

// The page /metrics, by plain HTTP.
class Endpoint {
  public:
    // `address`: "HOST:PORT", port 0: any free one. `ask` is called on another thread for each
    // scrape, from now until this object dies, which takes up to two seconds. Throws kUnavailable
    // if it can't listen there, kInvalidArgument for IPv6.
    Endpoint(const std::string& address, std::function<std::optional<FarmStatus>()> ask);
    ~Endpoint();

    int port() const { return port_; }

  private:
    class Collector;
    std::shared_ptr<Collector> collector_;
    std::unique_ptr<prometheus::Exposer> exposer_;
    int port_ = 0;
};

}  // namespace relume::metrics

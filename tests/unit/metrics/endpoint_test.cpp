#include "server/metrics/endpoint.h"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>
#include <vector>

#include "core/base/error.h"
#include "tests/support/scrape.h"

namespace relume::metrics {
namespace {

TEST(Endpoint, AsksAtEachScrape) {
    std::atomic<int> asked{0};
    const Endpoint endpoint("127.0.0.1:0", [&] {
        FarmStatus status;
        status.queue.totals.samples = static_cast<std::uint64_t>(++asked);
        return status;
    });
    ASSERT_GT(endpoint.port(), 0);
    EXPECT_EQ(asked, 0);
    EXPECT_EQ(Scrape(endpoint.port()).At("relume_samples_total"), 1);
    EXPECT_EQ(Scrape(endpoint.port()).At("relume_samples_total"), 2);
}

TEST(Endpoint, ServesNothingElse) {
    const Endpoint endpoint("127.0.0.1:0", [] { return FarmStatus(); });
    for (const char* path : {"/", "/etc/passwd", "/../../etc/passwd", "/metric"}) {
        const std::string answer = HttpGet(endpoint.port(), path);
        EXPECT_EQ(answer.find(" 200 "), std::string::npos) << path << ": " << answer.substr(0, 200);
        EXPECT_NE(answer.find("HTTP/1."), std::string::npos) << path;
    }
}

TEST(Endpoint, SaysThatTheCoordinatorDoesNotAnswer) {
    const Endpoint endpoint("127.0.0.1:0", [] { return std::nullopt; });
    const Exposition page = Scrape(endpoint.port());
    EXPECT_EQ(page.At("relume_coordinator_responding"), 0);
    EXPECT_FALSE(page.Has("relume_samples_total"));
}

TEST(Endpoint, APortThatIsTakenIsSaid) {
    const Endpoint first("127.0.0.1:0", [] { return FarmStatus(); });
    const std::string address = "127.0.0.1:" + std::to_string(first.port());
    try {
        const Endpoint second(address, [] { return FarmStatus(); });
        FAIL() << "two on one port";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kUnavailable);
        EXPECT_THAT(error.what(), testing::HasSubstr(address));
        EXPECT_THAT(error.what(), testing::HasSubstr("--metrics"));
    }
}

TEST(Endpoint, RefusesIPv6WithAReason) {
    try {
        const Endpoint endpoint("[::1]:0", [] { return FarmStatus(); });
        FAIL() << "civetweb has learned IPv6";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
        EXPECT_THAT(error.what(), testing::HasSubstr("IPv4"));
    }
}

TEST(Endpoint, TakesHostsByName) {
    const Endpoint named("localhost:0", [] { return FarmStatus(); });
    EXPECT_EQ(Scrape(named.port()).At("relume_coordinator_responding"), 1);
}

TEST(Endpoint, ManyScrapesAtOnceAndTheEndDoNoHarm) {
    auto endpoint = std::make_unique<Endpoint>("127.0.0.1:0", [] { return FarmStatus(); });
    std::vector<std::thread> scrapers;
    std::atomic<int> pages{0};
    for (int i = 0; i < 8; ++i) {
        scrapers.emplace_back([&, port = endpoint->port()] {
            for (int n = 0; n < 20; ++n) {
                pages += Scrape(port).Has("relume_samples_total") ? 1 : 0;
            }
        });
    }
    for (auto& scraper : scrapers) {
        scraper.join();
    }
    EXPECT_EQ(pages, 160);
    const int port = endpoint->port();
    endpoint.reset();
    EXPECT_THROW(Scrape(port), std::runtime_error);
}

}  // namespace
}  // namespace relume::metrics

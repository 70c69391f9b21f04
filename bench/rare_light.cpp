// relume-rare-light: energy that samplers keep where light is rarely found (scenes/rare_light),
// over many seeds.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "tests/support/rare_light.h"

int main(int argc, char** argv) {
    std::vector<std::string> samplers{"uniform", "adaptive:by=noise", "paper:mode=printed",
                                      "paper:mode=corrected"};
    std::vector<std::string> chances{"050", "020", "005"};
    int spp = 24, size = 48, seeds = 256, threads = 2;
    CLI::App app("Energy that samplers keep where light is rarely found.");
    app.add_option("--sampler", samplers)->capture_default_str();
    app.add_option("--chance", chances, "in thousandths: 050, 020, 005")->capture_default_str();
    app.add_option("--spp", spp, "mean samples a pixel")->capture_default_str();
    app.add_option("--size", size, "a multiple of 48")->capture_default_str();
    app.add_option("--seeds", seeds)->capture_default_str();
    app.add_option("--threads", threads)->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    relume::SetThreadCount(threads);
    try {
        fmt::print("{:<24}{:>6}{:>22}{:>24}{:>10}{:>18}\n", "sampler", "p", "energy of the light",
                   "without luck", "spp there", "other thirds");
        for (const auto& chance : chances) {
            for (const auto& sampler : samplers) {
                const auto r = relume::test::MeasureRareLight(chance, sampler, spp, size, seeds);
                const auto text = [](const relume::Moments& m) {
                    return fmt::format("{:.5f} ~{:.5f}", m.mean, std::sqrt(m.MeanVariance()));
                };
                fmt::print("{:<24}{:>6}{:>22}{:>24}{:>10.1f}{:>9.4f}{:>9.4f}\n", sampler,
                           "." + chance, text(r.energy), text(r.without_luck), r.samples.mean,
                           r.other[0].mean, r.other[1].mean);
                std::fflush(stdout);
            }
        }
    } catch (const std::exception& error) {
        std::fprintf(stderr, "relume-rare-light: %s\n", error.what());
        return 1;
    }
    return 0;
}

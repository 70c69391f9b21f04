#include "core/film/film.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/base/error.h"
#include "tests/unit/film/samples.h"

namespace relume {
namespace {

constexpr TileRect kWindow{10, 20, 31, 33};

// Every bit of the film.
std::vector<float> Bits(const Film& film) {
    std::vector<float> bits;
    for (int channel = 0; channel < kFilmChannelCount; ++channel) {
        const auto plane = film.Plane(channel);
        bits.insert(bits.end(), plane.begin(), plane.end());
    }
    return bits;
}

// Three passes of 8 samples a pixel, each merged tile by tile.
Film Render(int tile_size, bool backwards) {
    Film film(kWindow, 64, 48);
    for (std::uint32_t first = 0; first < 24; first += 8) {
        auto tiles = CutIntoTiles(kWindow, tile_size);
        if (backwards) {
            std::reverse(tiles.begin(), tiles.end());
        }
        for (const TileRect& tile : tiles) {
            film.Merge(MakeResult(tile, AllPixels(tile), first, 8));
        }
    }
    return film;
}

// A result whose sample i of pixel p has x = first + i and y = p.
TileResult WithSamples(TileResult result, std::uint32_t first, std::uint32_t count) {
    for (const std::uint32_t pixel : result.pixels) {
        for (std::uint32_t i = 0; i < count; ++i) {
            SampleRecord record;
            record.x = static_cast<float>(first + i);
            record.y = static_cast<float>(pixel);
            result.samples.push_back(record);
        }
    }
    return result;
}

TEST(Film, KeepsSamplesInOrderOfTheirIndex) {
    Film film(kWindow, 64, 48);
    const TileRect tile{12, 21, 15, 23};
    const std::vector<std::uint32_t> some = {1, 5};
    film.Merge(WithSamples(MakeResult(tile, AllPixels(tile), 0, 2), 0, 2));
    film.Merge(WithSamples(MakeResult(tile, some, 2, 3), 2, 3));
    ASSERT_NE(film.samples(), nullptr);
    for (int y = kWindow.y0; y < kWindow.y1; ++y) {
        for (int x = kWindow.x0; x < kWindow.x1; ++x) {
            const auto i =
                static_cast<std::size_t>((y - kWindow.y0) * kWindow.width() + x - kWindow.x0);
            const auto records = film.samples()->Of(i);
            const int pixel = (y - tile.y0) * tile.width() + x - tile.x0;
            const bool in = tile.Contains({x, y, x + 1, y + 1});
            ASSERT_EQ(records.size(), !in ? 0u : pixel == 1 || pixel == 5 ? 5u : 2u);
            for (std::size_t k = 0; k < records.size(); ++k) {
                EXPECT_EQ(records[k].x, static_cast<float>(k));
                EXPECT_EQ(records[k].y, static_cast<float>(pixel));
            }
        }
    }
    TileResult wrong = WithSamples(MakeResult(tile, some, 5, 2), 5, 1);
    const auto before = Bits(film);
    EXPECT_THROW(film.Merge(wrong), Error);
    EXPECT_EQ(Bits(film), before);
    EXPECT_EQ(Render(16, false).samples(), nullptr);
}

// One pixel whose halves hold the given samples of red.
Film OnePixel(const std::vector<float>& a, const std::vector<float>& b) {
    PixelMoments moments;
    const auto add = [&](std::uint32_t index, float red) {
        PixelSample sample;
        sample.radiance = {red, 0, 0};
        moments.Add(index, sample);
    };
    for (const float red : a) {
        add(0, red);
    }
    for (const float red : b) {
        add(1, red);
    }
    TileResult result{{0, 0, 1, 1}, {0}, std::vector<float>(kFilmChannelCount), 0, 0};
    moments.Store(result.planes.data(), 1);
    Film film({0, 0, 1, 1}, 1, 1);
    film.Merge(result);
    return film;
}

TEST(Film, BeginsEmpty) {
    const Film film(kWindow, 64, 48);
    EXPECT_EQ(film.width(), 21);
    EXPECT_EQ(film.height(), 13);
    EXPECT_EQ(film.pixel_count(), 273u);
    EXPECT_EQ(film.display_width(), 64);
    EXPECT_EQ(film.display_height(), 48);
    EXPECT_EQ(film.window(), kWindow);
    EXPECT_THAT(Bits(film), testing::Each(0.0f));
    EXPECT_EQ(film.NextIndex(0), 0u);
    EXPECT_EQ(film.Mean(0).x, 0);
    EXPECT_EQ(film.MeanVariance(0).x, 0);
    EXPECT_EQ(film.EstimateRelMSE(), 0);
    EXPECT_EQ(film.TotalSamples(), 0);
}

TEST(Film, BitsDoNotDependOnTilesOrOrderOfArrival) {
    const auto bits = Bits(Render(16, false));
    EXPECT_EQ(Bits(Render(16, true)), bits);
    EXPECT_EQ(Bits(Render(1, false)), bits);
    EXPECT_EQ(Bits(Render(5, true)), bits);
    EXPECT_EQ(Bits(Render(64, false)), bits);
}

TEST(Film, ACropHasTheBitsOfTheFullFrame) {
    const Film full = Render(16, false);
    const TileRect window{14, 22, 20, 30};
    Film crop(window, 64, 48);
    for (std::uint32_t first = 0; first < 24; first += 8) {
        crop.Merge(MakeResult(window, AllPixels(window), first, 8));
    }
    for (int channel = 0; channel < kFilmChannelCount; ++channel) {
        for (int y = 0; y < crop.height(); ++y) {
            for (int x = 0; x < crop.width(); ++x) {
                const int in_full = (y + 2) * full.width() + x + 4;
                ASSERT_EQ(crop.Plane(channel)[static_cast<std::size_t>(y * crop.width() + x)],
                          full.Plane(channel)[static_cast<std::size_t>(in_full)]);
            }
        }
    }
}

TEST(Film, MergeTouchesTheSampledPixelsAlone) {
    Film film(kWindow, 64, 48);
    const TileRect tile{12, 21, 16, 24};
    film.Merge(MakeResult(tile, {1, 6, 11}, 0, 4));
    EXPECT_EQ(film.TotalSamples(), 12);
    for (const auto& [x, y] : {std::pair{13, 21}, {14, 22}, {15, 23}}) {
        const auto i = static_cast<std::size_t>((y - 20) * film.width() + x - 10);
        EXPECT_EQ(film.NextIndex(i), 4u);
        EXPECT_EQ(film.Plane(kCountA)[i], 2);
        EXPECT_GT(film.Mean(i).y, 0);
    }
    film.Merge(MakeResult(tile, {}, 4, 4));
    EXPECT_EQ(film.TotalSamples(), 12);
}

TEST(Film, RejectsResultsThatDoNotFitAndStaysAsItWas) {
    Film film = Render(16, false);
    const auto bits = Bits(film);
    const TileRect tile{12, 21, 16, 24};
    const auto fails = [&](const TileResult& result) {
        try {
            film.Merge(result);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
            EXPECT_EQ(Bits(film), bits);
            return;
        }
        ADD_FAILURE() << "nothing was thrown";
    };
    TileResult result = MakeResult(tile, {0, 3}, 24, 2);
    result.rect = {9, 21, 13, 24};  // left of the window
    fails(result);
    result.rect = {29, 31, 33, 34};  // beyond its corner
    fails(result);
    result.rect = {12, 21, 12, 24};  // empty
    fails(result);
    result.rect = {16, 24, 12, 21};  // inside out
    fails(result);
    result = MakeResult(tile, {0, 3}, 24, 2);
    result.planes.pop_back();
    fails(result);
    result.planes.clear();
    fails(result);
    fails(MakeResult(tile, {0, 12}, 24, 2));  // beyond the tile
    fails(MakeResult(tile, {3, 3}, 24, 2));   // twice
    fails(MakeResult(tile, {3, 0}, 24, 2));   // falling
}

TEST(Film, MeanIsOfAllSamples) {
    const Film film = OnePixel({1, 2, 3}, {10});
    EXPECT_FLOAT_EQ(film.Mean(0).x, 4);
    EXPECT_EQ(film.Mean(0).y, 0);
    EXPECT_EQ(film.SampleCount(0), 4);
    EXPECT_FLOAT_EQ(OnePixel({}, {10}).Mean(0).x, 10);
}

TEST(Film, MeanVarianceWeighsTheHalves) {
    // Half a: mean variance 2/(3*2) = 1/3; half b: 8/(2*1) = 4; of 5 samples.
    const Film film = OnePixel({1, 2, 3}, {2, 6});
    EXPECT_FLOAT_EQ(film.MeanVariance(0).x, (1.0f / 3) * 9 / 25 + 4.0f * 4 / 25);
    EXPECT_EQ(film.MeanVariance(0).y, 0);
    EXPECT_EQ(OnePixel({1}, {9}).MeanVariance(0).x, 0);
}

TEST(Film, HalfVarianceIsOfTheDifferenceOfTheHalves) {
    // (2 - 4)^2 * 3 * 2 / 25
    EXPECT_FLOAT_EQ(OnePixel({1, 2, 3}, {2, 6}).HalfVariance(0).x, 0.96f);
    EXPECT_FLOAT_EQ(OnePixel({1}, {9}).HalfVariance(0).x, 16);
    EXPECT_EQ(OnePixel({1, 5}, {}).HalfVariance(0).x, 0);
}

TEST(Film, VariancesAreThoseOfTheMeanOverManyPixels) {
    // Independent samples: both estimates average to the variance of a sample over n.
    const TileRect window{0, 0, 100, 100};
    Film film(window, 100, 100);
    film.Merge(MakeResult(window, AllPixels(window), 0, 8));
    double mean = 0, half = 0;
    Moments of_means;
    for (std::size_t i = 0; i < film.pixel_count(); ++i) {
        mean += film.MeanVariance(i).y;
        half += film.HalfVariance(i).y;
        of_means.Add(film.Mean(i).y);
    }
    mean /= static_cast<double>(film.pixel_count());
    half /= static_cast<double>(film.pixel_count());
    // Of 10,000 pixels: standard error about 1.4 % where one degree of freedom is squared.
    EXPECT_NEAR(mean / of_means.SampleVariance(), 1, 0.06);
    EXPECT_NEAR(half / of_means.SampleVariance(), 1, 0.06);
}

TEST(Film, RelMSEIsEstimatedFromTheHalves) {
    // Variance 16 around a mean of 5 in one of three channels.
    EXPECT_NEAR(OnePixel({1}, {9}).EstimateRelMSE(), 16 / 25.01 / 3, 1e-6);
}

TEST(Film, BadSamplesCountForTheIndexOnly) {
    PixelMoments moments = MakeMoments(0, 0, 4);
    PixelSample bad;
    bad.radiance.x = std::numeric_limits<float>::infinity();
    moments.Add(4, bad);
    TileResult result{{0, 0, 1, 1}, {0}, std::vector<float>(kFilmChannelCount), 0, 0};
    moments.Store(result.planes.data(), 1);
    Film film({0, 0, 2, 1}, 2, 1);
    film.Merge(result);
    EXPECT_EQ(film.NextIndex(0), 5u);
    EXPECT_EQ(film.SampleCount(0), 4);
    EXPECT_EQ(film.TotalSamples(), 4);
    EXPECT_EQ(film.TotalBadSamples(), 1);
}

}  // namespace
}  // namespace relume

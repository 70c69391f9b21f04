#include <cstddef>

#include "core/scene/pbrt_spectra.h"

// The spectra that pbrt-v4 knows by name, reduced to Rec. 709.
namespace relume::pbrt {
namespace {

struct Metal {
    std::string_view name;
    Rgb eta, k;
};

// Ag, Al, Au, Cu: the reduction that Mitsuba's and Tungsten's tables of conductors give (data of
// Palik, "Handbook of Optical Constants of Solids", 1985). CuZn: Querry, "Optical constants of
// minerals and other materials", 1985. MgO, TiO2 (rutile; the extraordinary ray, as in pbrt's
// data): dispersion formulas of Stephens and Malitson 1952 and Devore 1951 at 650, 550 and 450 nm.
constexpr Metal kMetals[] = {
    {"Ag", {0.155265f, 0.116723f, 0.138381f}, {4.828343f, 3.122246f, 2.147050f}},
    {"Al", {1.657460f, 0.880369f, 0.521229f}, {9.223869f, 6.269523f, 4.837001f}},
    {"Au", {0.143119f, 0.374957f, 1.442479f}, {3.983160f, 2.385721f, 1.603215f}},
    {"Cu", {0.200438f, 0.924033f, 1.102212f}, {3.912949f, 2.452848f, 2.142188f}},
    {"CuZn", {0.444f, 0.527f, 1.094f}, {3.695f, 2.765f, 1.829f}},
    {"MgO", {1.7337f, 1.7405f, 1.7524f}, {0, 0, 0}},
    {"TiO2", {2.860f, 2.953f, 3.163f}, {0, 0, 0}},
};

struct Glass {
    std::string_view name;
    float eta;  // at the helium line, 587.6 nm (Schott; pbrt takes F5, F10, F11 for SF5, ...)
};
constexpr Glass kGlasses[] = {
    {"BK7", 1.5168f}, {"BAF10", 1.6700f}, {"FK51A", 1.4866f}, {"LASF9", 1.8503f}, {"SF5", 1.6727f},
    {"F5", 1.6727f},  {"SF10", 1.7283f},  {"F10", 1.7283f},   {"SF11", 1.7847f},  {"F11", 1.7847f},
};

struct Illuminant {
    std::string_view name;
    float x, y;  // CIE 15:2004, table T.3 and after
};
constexpr Illuminant kIlluminants[] = {
    {"stdillum-A", 0.44757f, 0.40745f},   {"stdillum-D50", 0.34567f, 0.35851f},
    {"stdillum-D65", 0.31271f, 0.32902f}, {"illum-acesD60", 0.32168f, 0.33767f},
    {"stdillum-F1", 0.3131f, 0.3371f},    {"stdillum-F2", 0.3721f, 0.3751f},
    {"stdillum-F3", 0.4091f, 0.3941f},    {"stdillum-F4", 0.4402f, 0.4031f},
    {"stdillum-F5", 0.3138f, 0.3452f},    {"stdillum-F6", 0.3779f, 0.3882f},
    {"stdillum-F7", 0.3129f, 0.3292f},    {"stdillum-F8", 0.3458f, 0.3586f},
    {"stdillum-F9", 0.3741f, 0.3727f},    {"stdillum-F10", 0.3458f, 0.3588f},
    {"stdillum-F11", 0.3805f, 0.3769f},   {"stdillum-F12", 0.4370f, 0.4042f},
};

}  // namespace

std::optional<Rgb> NamedIndex(std::string_view name) {
    constexpr std::string_view kMetal = "metal-", kGlass = "glass-";
    if (name.substr(0, kGlass.size()) == kGlass) {
        for (const Glass& glass : kGlasses) {
            if (name.substr(kGlass.size()) == glass.name) {
                return Rgb{1, 1, 1} * glass.eta;
            }
        }
        return std::nullopt;
    }
    const std::size_t dash = name.rfind('-');
    if (name.substr(0, kMetal.size()) != kMetal || dash < kMetal.size()) {
        return std::nullopt;
    }
    const std::string_view element = name.substr(kMetal.size(), dash - kMetal.size());
    const std::string_view part = name.substr(dash + 1);
    for (const Metal& metal : kMetals) {
        if (metal.name == element && (part == "eta" || part == "k")) {
            return part == "eta" ? metal.eta : metal.k;
        }
    }
    return std::nullopt;
}

std::optional<Rgb> NamedIlluminant(std::string_view name) {
    for (const Illuminant& i : kIlluminants) {
        if (i.name == name) {
            return Max(XyzToRgb({i.x / i.y, 1, (1 - i.x - i.y) / i.y}), {0, 0, 0});
        }
    }
    return std::nullopt;
}

}  // namespace relume::pbrt

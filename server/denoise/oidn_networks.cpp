#include "server/denoise/oidn_networks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "server/denoise/network/weights.h"

namespace relume::denoise {
namespace {

// The way up from "enc_conv5b", the same in all sizes but for the name of the last layer.
GraphSpec WithDecoder(std::vector<LayerSpec> layers, const std::string& last) {
    const LayerSpec decoder[] = {
        Upsample("up4", "enc_conv5b"),        Concatenate("concat4", {"up4", "pool3"}),
        Convolution("dec_conv4a", "concat4"), Convolution("dec_conv4b", "dec_conv4a"),
        Upsample("up3", "dec_conv4b"),        Concatenate("concat3", {"up3", "pool2"}),
        Convolution("dec_conv3a", "concat3"), Convolution("dec_conv3b", "dec_conv3a"),
        Upsample("up2", "dec_conv3b"),        Concatenate("concat2", {"up2", "pool1"}),
        Convolution("dec_conv2a", "concat2"), Convolution("dec_conv2b", "dec_conv2a"),
        Upsample("up1", "dec_conv2b"),        Concatenate("concat1", {"up1", "input"}),
        Convolution("dec_conv1a", "concat1"), Convolution("dec_conv1b", "dec_conv1a"),
        Convolution(last, "dec_conv1b"),
    };
    layers.insert(layers.end(), std::begin(decoder), std::end(decoder));
    return {std::move(layers)};
}

}  // namespace

GraphSpec OidnGraph() {
    return WithDecoder(
        {
            Convolution("enc_conv0", "input"),
            Convolution("enc_conv1", "enc_conv0"),
            Pool("pool1", "enc_conv1"),
            Convolution("enc_conv2", "pool1"),
            Pool("pool2", "enc_conv2"),
            Convolution("enc_conv3", "pool2"),
            Pool("pool3", "enc_conv3"),
            Convolution("enc_conv4", "pool3"),
            Pool("pool4", "enc_conv4"),
            Convolution("enc_conv5a", "pool4"),
            Convolution("enc_conv5b", "enc_conv5a"),
        },
        "dec_conv0");
}

GraphSpec OidnLargeGraph() {
    return WithDecoder(
        {
            Convolution("enc_conv1a", "input"),
            Convolution("enc_conv1b", "enc_conv1a"),
            Pool("pool1", "enc_conv1b"),
            Convolution("enc_conv2a", "pool1"),
            Convolution("enc_conv2b", "enc_conv2a"),
            Pool("pool2", "enc_conv2b"),
            Convolution("enc_conv3a", "pool2"),
            Convolution("enc_conv3b", "enc_conv3a"),
            Pool("pool3", "enc_conv3b"),
            Convolution("enc_conv4a", "pool3"),
            Convolution("enc_conv4b", "enc_conv4a"),
            Pool("pool4", "enc_conv4b"),
            Convolution("enc_conv5a", "pool4"),
            Convolution("enc_conv5b", "enc_conv5a"),
        },
        "dec_conv1c");
}

void CheckOidnNetwork(const std::string& name) {
    if (NetworkSource(name).empty()) {
        throw Error(ErrorCode::kFailedPrecondition,
                    fmt::format("filter 'oidn' needs Open Image Denoise's weights {}.tza, which "
                                "are in none of {}: deploy/fetch-oidn gets them, or set "
                                "RELUME_NETWORKS to their folder",
                                name, NetworkFolders()));
    }
}

bool HasOidnNetworks() {
    return std::ranges::none_of(
        std::array{kOidnCleanNetwork, kOidnNoisyNetwork, kOidnAlbedoNetwork, kOidnNormalNetwork},
        [](const char* name) { return NetworkSource(name).empty(); });
}

std::shared_ptr<const Network> LoadOidnNetwork(const std::string& name) {
    static std::mutex mutex;
    static std::map<std::string, std::shared_ptr<const Network>> loaded;  // by source
    CheckOidnNetwork(name);
    const std::lock_guard lock(mutex);
    std::shared_ptr<const Network>& network = loaded[NetworkSource(name)];
    if (!network) {
        const auto weights = FindNetworkWeights(name);
        const bool large = name.ends_with("_large");
        network = std::make_shared<Network>(large ? OidnLargeGraph() : OidnGraph(),
                                            weights->tensors, weights->source);
    }
    return network;
}

}  // namespace relume::denoise

#include "server/denoise/network/weights.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <vector>

#include "server/denoise/network/built_in.h"

namespace relume::denoise {
namespace {

namespace fs = std::filesystem;

std::string Variable(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

std::vector<fs::path> SharedFolders() {
    std::vector<fs::path> folders;
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error);
    if (!error) {
        folders.push_back(program.parent_path().parent_path() / "share/relume/networks");
    }
    fs::path data = Variable("XDG_DATA_HOME");
    if (data.empty() && !Variable("HOME").empty()) {
        data = fs::path(Variable("HOME")) / ".local/share";
    }
    if (!data.empty()) {
        folders.push_back(data / "relume/networks");
    }
    return folders;
}

std::vector<fs::path> ChosenFolders() {
    const std::string chosen = Variable("RELUME_NETWORKS");
    return chosen.empty() ? std::vector<fs::path>{} : std::vector<fs::path>{chosen};
}

// "" if none of them has it.
std::string PathIn(const std::vector<fs::path>& folders, const std::string& name) {
    for (const fs::path& folder : folders) {
        const fs::path path = folder / (name + ".tza");
        std::error_code error;
        if (fs::is_regular_file(path, error)) {
            return path.string();
        }
    }
    return "";
}

const BuiltInNetwork* FindBuiltIn(const std::string& name) {
    for (const BuiltInNetwork& network : BuiltInNetworks()) {
        if (name == network.name) {
            return &network;
        }
    }
    return nullptr;
}

}  // namespace

std::string NetworkSource(const std::string& name) {
    const std::string chosen = PathIn(ChosenFolders(), name);
    return !chosen.empty()     ? chosen
           : FindBuiltIn(name) ? name + ", built in"
                               : PathIn(SharedFolders(), name);
}

std::optional<NetworkWeights> FindNetworkWeights(const std::string& name) {
    const std::string source = NetworkSource(name);
    if (source.empty()) {
        return std::nullopt;
    }
    const BuiltInNetwork* network = FindBuiltIn(name);
    const bool built_in = network != nullptr && source == name + ", built in";
    return NetworkWeights{source, built_in ? ParseTza(network->bytes, name) : ReadTza(source)};
}

std::string NetworkFolders() {
    std::vector<fs::path> folders = ChosenFolders();
    for (fs::path& folder : SharedFolders()) {
        folders.push_back(std::move(folder));
    }
    std::string text;
    for (const fs::path& folder : folders) {
        text += (text.empty() ? "" : ", ") + folder.string();
    }
    return text;
}

}  // namespace relume::denoise

#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/manifest.h"
#include "relume/v1/jobs.pb.h"

namespace relume::client {

// What the client alone knows of a job.
struct ReportFacts {
    SceneManifest scene;
    std::string output;              // path of the image
    std::vector<std::string> notes;  // of the preflight
    // Seconds of the client's phases.
    double check = 0;  // listing, hashing, loading for checks
    double start = 0;  // starting a local farm
    double upload = 0;
    double job = 0;  // created to over
    double fetch = 0;
    double total = 0;
    std::optional<double> time_limit;  // of the whole command
};

// Whether each sample is counted once, as the server's audit says; null before it.
nlohmann::ordered_json LedgerJson(const v1::Job& job);

// The report of a job that is over: docs/report.md says what each field means.
nlohmann::ordered_json MakeReport(const v1::Job& job, const ReportFacts& facts);

// The value, or null for what is not there.
template <typename T>
nlohmann::ordered_json OrNull(bool there, T value) {
    return there ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

// Pixels of the job's window.
double PixelsOf(const v1::JobSpec& spec);
// Mean samples a pixel of it.
double MeanSpp(const v1::Job& job);

}  // namespace relume::client

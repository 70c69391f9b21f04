#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/options.h"
#include "client/lib/client.h"
#include "client/lib/report.h"

namespace relume::client {

// Throws CommandError with the job's own words unless it has succeeded.
void RequireSuccess(const v1::Job& job);
// Likewise unless it has an image: of a job that was cancelled, too, if it had samples.
void RequireImage(const v1::Job& job);

// Fetches the result of a job and puts it where the user wants it. Image, view and report
// appear when all of them are whole. Completes `facts` (output, fetch, total: what passed before,
// and the fetching).
void SaveResult(Client* client, const v1::Job& job, const OutputOptions& output,
                ReportFacts* facts);

// A job in a line for people: state, size, samples, error.
std::string DescribeJob(const v1::Job& job);
// A job as the commands' --json tells it; docs/commands.md says what is in it.
nlohmann::ordered_json JobJson(const v1::Job& job);

// From a job's making to its end, by the server's clock.
double SecondsOf(const v1::Job& job);

// "2026-01-31T12:00:00Z", "" if unset.
std::string FormatTime(const google::protobuf::Timestamp& time);

}  // namespace relume::client

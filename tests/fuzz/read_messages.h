#pragma once

#include <string>
#include <string_view>

namespace relume::test {

// Messages of clients and workers, as ReadInput's kinds:
// "codec": a byte that says which message, and the message: what codec makes of it is checked.
// "spec": a JobSpec, given to the server's check of new jobs.
// "work": what a worker says after its Hello, each message with its length (4 bytes) before it,
// given to a queue with a job in it: whatever comes, an honest worker then ends the job with the
// image that it always has.
void ReadMessages(const std::string& kind, std::string_view bytes);

}  // namespace relume::test

// The jobs of a site, as the workflow's engine starts them: each is this program with --job.
#pragma once

#include <string>

namespace slcmap::inline commands {

// Does a job of the site in a folder, unless its result is there, and leaves its result, also where
// it fails: that is no error, so that others go on. Waits while another process does the same job.
// Throws StoppedError after Ctrl-C, OutputError where the result cannot be written, and DataError
// where the site has no such job.
void RunSiteJob(const std::string& folder, const std::string& name, int threads);

}  // namespace slcmap::commands

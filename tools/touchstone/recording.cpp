// touchstone export and recover: recordings as CSV, and made whole after a crash.
#include "haptics/sandbox/record/recording.hpp"

#include <cstdio>

#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

int exportRecording(const ExportOptions& options) {
    if (options.fields) {
        std::fputs(sandbox::fieldsAsMarkdown().c_str(), stdout);
        return kOk;
    }
    if (options.recording.empty()) throw UsageError("touchstone export needs DIR, the folder of a recording");
    std::filesystem::path output = options.output;
    if (output.empty()) {
        output = options.recording;
        if (!output.has_filename()) output = output.parent_path();  // DIR/
        output += ".csv";
    }
    sandbox::exportCsv(options.recording, output);
    return kOk;
}

int recoverRecording(const std::filesystem::path& folder) {
    std::fputs(sandbox::recoverRecording(folder).c_str(), stdout);
    return kOk;
}

}  // namespace touchstone::app

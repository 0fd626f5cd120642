// touchstone export and recover: writes recordings as CSV, and repairs interrupted ones.
#include "haptics/sandbox/record/recording.hpp"

#include <cstdio>

#include "tools/touchstone/command_line.hpp"

namespace touchstone::app {
namespace {

struct ExportOptions {
    std::filesystem::path recording, output;  ///< no output: the recording's folder with .csv
    bool fields = false;                      ///< print the table of columns instead
};

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

}  // namespace

void addExport(CLI::App& program, Action& action) {
    const auto options = std::make_shared<ExportOptions>();
    CLI::App* command = addCommand(program, "export", "Write the ticks of a recording as CSV",
                                   "Example:\n  touchstone export push --out push.csv\n");
    command->add_option("DIR", options->recording, kRecordingHelp);
    command->add_option("--out", options->output, "CSV file (default: DIR.csv)");
    command->add_flag("--fields", options->fields, "print the columns and their meaning as a Markdown table, and exit");
    command->callback([options, &action] { action = [options] { return exportRecording(*options); }; });
}

void addRecover(CLI::App& program, Action& action) {
    const auto folder = std::make_shared<std::filesystem::path>();
    CLI::App* command =
        addCommand(program, "recover", "Repair an interrupted recording", "Example:\n  touchstone recover push\n");
    command->add_option("DIR", *folder, kRecordingHelp)->required();
    command->callback([folder, &action] { action = [folder] { return recoverRecording(*folder); }; });
}

}  // namespace touchstone::app

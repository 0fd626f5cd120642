// touchstone export, verify and recover: writes recordings for other programs, confirms them, and repairs interrupted
// ones.
#include "haptics/sandbox/record/recording.hpp"

#include <spdlog/spdlog.h>

#include <cstdio>

#include "engine/scene/scene.hpp"
#include "haptics/sandbox/exchange/exchange.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"

namespace touchstone::app {
namespace {

struct ExportOptions {
    sandbox::ExportRequest request;
    std::filesystem::path output;  ///< of the CSV; empty: the recording's folder with .csv
    bool fields = false;           ///< print the table of columns instead
    bool byHash = false;           ///< scenes are only named
};

void printLine(const std::string& line) { std::printf("%s\n", line.c_str()); }

int exportRecording(ExportOptions& options) {
    if (options.fields) {
        std::fputs(sandbox::fieldsAsMarkdown().c_str(), stdout);
        return kOk;
    }
    sandbox::ExportRequest& request = options.request;
    if (request.recordings.empty()) throw UsageError("touchstone export needs DIR, the folder of a recording");
    if (!request.hdf5.empty() || !request.mcap.empty()) {
        if (!options.output.empty()) throw UsageError("--out is the CSV file: give it without --hdf5 and --mcap");
        if (request.hdf5 == request.mcap) throw UsageError("--hdf5 and --mcap need different files");
        request.carryScenes = !options.byHash;
        request.progress = progressBar();
        request.report = printLine;
        exportDemonstrations(request);
        return kOk;
    }
    if (options.byHash) throw UsageError("--by-hash needs --hdf5 or --mcap");
    if (request.recordings.size() > 1)
        throw UsageError("a CSV holds one recording: give one DIR, or write all of them with --hdf5 or --mcap");
    std::filesystem::path output = options.output;
    if (output.empty()) {
        output = request.recordings.front();
        if (!output.has_filename()) output = output.parent_path();  // DIR/
        output += ".csv";
    }
    sandbox::exportCsv(request.recordings.front(), output);
    return kOk;
}

struct VerifyOptions {
    std::vector<std::filesystem::path> files;
    std::filesystem::path scene;  ///< where scenes are; empty: see findRecordedScene()
};

/// Every file is checked, also after one that fails.
int verify(const VerifyOptions& options) {
    const std::vector<std::filesystem::path>& files = options.files;
    int code = kOk;
    for (const std::filesystem::path& file : files) try {
            sandbox::verifyDemonstrations(file, progressBar(), printLine, options.scene);
            std::printf("%s: confirmed\n", file.c_str());
        } catch (const std::exception& error) {
            if (file == files.back()) throw;
            spdlog::error("{}", engine::escaped(error.what()));
            code = kFailed;
        }
    return code;
}

int recoverRecording(const std::filesystem::path& folder) {
    std::fputs(sandbox::recoverRecording(folder).c_str(), stdout);
    return kOk;
}

}  // namespace

void addExport(CLI::App& program, Action& action) {
    const auto options = std::make_shared<ExportOptions>();
    CLI::App* command = addCommand(
        program, "export", "Write recordings for other programs: as CSV, HDF5 or MCAP",
        "HDF5 and MCAP files hold demonstrations that were replayed and agree with their recordings; `touchstone\n"
        "verify` confirms them elsewhere.\n\n"
        "Examples:\n"
        "  touchstone export push --out push.csv                  the ticks of one recording as a table\n"
        "  touchstone export study/trial-* --hdf5 study.hdf5      demonstrations in robomimic's layout\n"
        "  touchstone export push --mcap push.mcap                poses and wrench for Foxglove and similar programs\n"
        "  touchstone export push --hdf5 push.hdf5 --by-hash      without the scene, which verify must find\n");
    command->add_option("DIR", options->request.recordings, kRecordingHelp);
    command->add_option("--out", options->output, "CSV file (default: DIR.csv)");
    command->add_option("--hdf5", options->request.hdf5, "write all recordings to this HDF5 file instead");
    command->add_option("--mcap", options->request.mcap, "write all recordings to this MCAP file instead");
    command->add_flag("--by-hash", options->byHash,
                      "name scenes and meshes by the hash of their content instead of including them in the file");
    addRecordedScene(*command, options->request.scene);
    command->add_flag("--fields", options->fields, "print the columns and their meaning as a Markdown table, and exit");
    command->callback([options, &action] { action = [options] { return exportRecording(*options); }; });
}

void addVerify(CLI::App& program, Action& action) {
    const auto options = std::make_shared<VerifyOptions>();
    CLI::App* command = addCommand(
        program, "verify", "Confirm recordings and exported demonstrations tick by tick",
        "Replays every demonstration: to the bit in the build that recorded it, within a stated tolerance in\n"
        "another (docs/recording.md). One sentence says what is missing, damaged or different, and the exit code\n"
        "is then 1.\n\n"
        "Examples:\n"
        "  touchstone verify study.hdf5\n"
        "  touchstone verify push.mcap push study/trial-*\n");
    command->add_option("FILE", options->files, "a file that `touchstone export` wrote, or the folder of a recording")
        ->required();
    addRecordedScene(*command, options->scene);
    command->callback([options, &action] { action = [options] { return verify(*options); }; });
}

void addRecover(CLI::App& program, Action& action) {
    const auto folder = std::make_shared<std::filesystem::path>();
    CLI::App* command =
        addCommand(program, "recover", "Repair an interrupted recording", "Example:\n  touchstone recover push\n");
    command->add_option("DIR", *folder, kRecordingHelp)->required();
    command->callback([folder, &action] { action = [folder] { return recoverRecording(*folder); }; });
}

}  // namespace touchstone::app

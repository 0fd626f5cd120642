#include "engine/scene/step_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "engine/scene/folders.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/text.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kStart = "ISO-10303-21;", kEnd = "END-ISO-10303-21;";
constexpr const char* kExportAgain = "export the parts from the CAD program as STEP AP203, AP214 or AP242";

/// The program that reads STEP: that of $TOUCHSTONE_STEP; in a build folder the one beside this program, in an
/// installation the one below the prefix.
fs::path readerProgram() {
    if (const char* named = std::getenv("TOUCHSTONE_STEP")) return named;
    const fs::path own = programFolder();
    std::error_code error;
    for (const fs::path& program : {own / "touchstone-step", own.parent_path() / "libexec/touchstone-step"})
        if (fs::is_regular_file(program, error)) return program;
    return {};
}

/// The text without comments.
std::string withoutComments(std::string_view text) {
    std::string rest;
    while (!text.empty()) {
        const std::size_t comment = text.find("/*");
        rest += text.substr(0, comment);
        if (comment == text.npos) break;
        const std::size_t end = text.find("*/", comment + 2);
        text.remove_prefix(end == text.npos ? text.size() : end + 2);
    }
    return rest;
}

/// AP203, AP214 or AP242; else the name that the file has.
std::string schemaOf(const std::string& header) {
    const std::size_t entry = header.find("FILE_SCHEMA");
    const std::size_t open = entry == header.npos ? header.npos : header.find('\'', entry);
    const std::size_t close = open == header.npos ? header.npos : header.find('\'', open + 1);
    if (close == header.npos) return {};
    std::string name = header.substr(open + 1, close - open - 1);
    name = name.substr(0, name.find_first_of(" {"));
    std::ranges::transform(name, name.begin(),
                           [](char c) { return static_cast<char>(std::toupper(static_cast<unsigned char>(c))); });
    for (const auto& [start, words] :
         {std::pair("CONFIG_CONTROL_", "AP203"), std::pair("AP203_", "AP203"), std::pair("AUTOMOTIVE_DESIGN", "AP214"),
          std::pair("AP214_", "AP214"), std::pair("AP242_", "AP242")})
        if (name.starts_with(start)) return words;
    return name;
}

/// Reads the header, and looks for the end. Throws SceneError for what is no complete STEP file of a known schema.
std::string checkedSchema(const fs::path& file) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (!fs::exists(status)) failIn(file, "", "does not exist; name a STEP file");
    if (!fs::is_regular_file(status)) failIn(file, "", std::string("is ") + kindOf(status) + "; name a STEP file");
    std::ifstream in(file, std::ios::binary);
    if (!in) failIn(file, "", std::string("cannot be read: ") + std::strerror(errno));
    constexpr std::size_t kHeader = 65536, kTail = 4096;
    std::string header(kHeader, '\0');
    in.read(header.data(), std::streamsize(header.size()));
    header.resize(std::size_t(in.gcount()));
    if (header.empty()) failIn(file, "", "is empty; export the parts again");
    if (header.starts_with("\xef\xbb\xbf")) header.erase(0, 3);
    header = withoutComments(header);
    const std::size_t first = header.find_first_not_of(" \t\r\n");
    if (first == header.npos || !header.substr(first).starts_with(kStart))
        failIn(file, "", "is not a STEP file, which begins with 'ISO-10303-21;'; " + std::string(kExportAgain));
    in.clear();
    in.seekg(0, std::ios::end);
    const std::streamoff size = in.tellg();
    in.seekg(std::max<std::streamoff>(0, size - std::streamoff(kTail)));
    std::string tail(kTail, '\0');
    in.read(tail.data(), std::streamsize(tail.size()));
    if (tail.find(kEnd) == tail.npos)
        failIn(file, "", "is truncated, as it does not end with 'END-ISO-10303-21;'; export or copy it again");
    std::string schema = schemaOf(header.substr(0, header.find("DATA;")));
    if (schema.empty()) failIn(file, "", "names no FILE_SCHEMA in its header; " + std::string(kExportAgain));
    if (!schema.starts_with("AP2"))
        failIn(file, "", "is STEP of the schema " + printable(schema) + ", which holds no parts; " + kExportAgain);
    return schema;
}

/// A process whose standard output and errors are read. Ends it when it goes out of scope.
class Child {
  public:
    explicit Child(const std::vector<std::string>& words) {
        for (int* ends : {output_, errors_})
            if (pipe2(ends, O_CLOEXEC) != 0) fail();
        std::vector<char*> arguments;
        for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
        arguments.push_back(nullptr);
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&actions, output_[1], STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&actions, errors_[1], STDERR_FILENO);
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        sigset_t none;
        sigemptyset(&none);
        posix_spawnattr_setsigmask(&attributes, &none);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
        errno = posix_spawn(&process_, arguments[0], &actions, &attributes, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        posix_spawnattr_destroy(&attributes);
        if (errno != 0) fail();
        for (int* ends : {output_, errors_}) {
            close(ends[1]);
            ends[1] = -1;
        }
    }
    ~Child() {
        kill();
        wait();
        for (const int end : {output_[0], output_[1], errors_[0], errors_[1]})
            if (end >= 0) close(end);
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// Waits for bytes for up to `ms`, and appends them. False when both streams have ended.
    bool read(std::string& output, std::string& errors, int ms) {
        pollfd ends[]{{open_[0] ? output_[0] : -1, POLLIN, 0}, {open_[1] ? errors_[0] : -1, POLLIN, 0}};
        poll(ends, 2, ms);
        for (int k = 0; k < 2; ++k) {
            if (!ends[k].revents) continue;
            char bytes[65536];
            const ssize_t count = ::read(ends[k].fd, bytes, sizeof bytes);
            if (count > 0)
                (k == 0 ? output : errors).append(bytes, std::size_t(count));
            else if (count == 0 || errno != EINTR)
                open_[k] = false;
        }
        return open_[0] || open_[1];
    }
    void kill() {
        if (process_ > 0) ::kill(process_, SIGKILL);
    }
    /// The status that waitpid() gives.
    int wait() {
        int status = 0;
        if (process_ > 0)
            while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
            }
        process_ = 0;
        return status;
    }

  private:
    [[noreturn]] static void fail() {
        throw SceneError(std::string("touchstone-step cannot be started: ") + std::strerror(errno));
    }

    int output_[2]{-1, -1}, errors_[2]{-1, -1};
    bool open_[2]{true, true};
    pid_t process_ = 0;
};

}  // namespace

bool isStepFile(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension == ".step" || extension == ".stp";
}

std::optional<std::vector<CadAssembly>> readStep(std::span<const fs::path> files, const StepOptions& options,
                                                 const StepProgress& progress) {
    std::vector<std::string> schemas;
    for (const fs::path& file : files) schemas.push_back(checkedSchema(file));
    const fs::path program = readerProgram();
    if (program.empty())
        failIn(files.front(), "",
               "is read by touchstone-step, which is missing: install the package touchstone-step, or, if you built "
               "touchstone yourself, install libocct-data-exchange-dev (apt install libocct-data-exchange-dev) and "
               "build it again");
    std::vector<std::string> words{program.string(), "--bytes", std::to_string(options.maxBytes)};
    if (!options.meshes) words.emplace_back("--list");
    if (options.inStep) words.emplace_back("--in-step");
    if (options.keepClearance) words.emplace_back("--keep-clearance");
    if (options.deviation) words.insert(words.end(), {"--deviation", formatted("%.17g", *options.deviation)});
    for (const std::string& name : options.only) words.insert(words.end(), {"--only", name});
    for (const fs::path& file : files) words.push_back(fs::absolute(file).string());

    std::string output, lines, error, doing = files.front().string();
    using Clock = std::chrono::steady_clock;
    const Clock::time_point end = Clock::now() + std::chrono::seconds(options.maxSeconds);
    double fraction = 0;
    const auto takeLines = [&] {
        for (std::size_t stop = lines.find('\n'); stop != lines.npos; stop = lines.find('\n')) {
            const std::string line = lines.substr(0, stop);
            lines.erase(0, stop + 1);
            if (line.starts_with("error ")) error = line.substr(6);
            if (!line.starts_with("progress ")) continue;
            const char* number = line.data() + 9;
            const auto [rest, problem] = std::from_chars(number, line.data() + line.size(), fraction);
            if (problem == std::errc() && *rest == ' ') doing = rest + 1;
        }
    };
    Child child(words);
    constexpr int kPollMs = 100;
    while (child.read(output, lines, kPollMs)) {
        takeLines();
        if (progress && !progress(doing, fraction)) return {};
        if (Clock::now() > end)
            failIn(files.front(), "",
                   formatted("was not read within %d s, while %s: give fewer or simpler parts, or a larger --deviation",
                             options.maxSeconds, escaped(doing).c_str()));
    }
    takeLines();
    const int status = child.wait();
    if (error == "memory" || (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL))
        failIn(files.front(), "",
               formatted("needs more than %.3g GB of memory, while %s: give fewer or simpler parts, or a larger "
                         "--deviation",
                         double(options.maxBytes) / double(1 << 30), escaped(doing).c_str()));
    if (!error.empty()) throw SceneError(escaped(error));
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
        failIn(files.front(), "",
               formatted("keeps Open Cascade busy without end, while %s: it is malformed, so export it again",
                         escaped(doing).c_str()));
    if (WIFSIGNALED(status))
        failIn(files.front(), "",
               formatted("makes Open Cascade crash (%s), while %s: heal the part in the CAD program, or export it as "
                         "another kind of STEP",
                         strsignal(WTERMSIG(status)), escaped(doing).c_str()));
    auto assemblies = cadFromBytes(output);
    if (!assemblies || assemblies->size() != files.size())
        failIn(files.front(), "", "was not read, as touchstone-step is not of this version: install both again");
    for (std::size_t i = 0; i < files.size(); ++i) (*assemblies)[i].schema = schemas[i];
    return assemblies;
}

}  // namespace touchstone::engine

// touchstone-step: reads STEP files by Open Cascade for touchstone, which starts it as a process of its own.
// Writes the bytes of engine/scene/cad_parts.hpp to standard output; "progress FRACTION WHAT" and "error SENTENCE" to
// the error stream, a line each.
#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Standard_Failure.hxx>
#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

#include "engine/scene/cad_clearance.hpp"
#include "tools/step/step_mesh.hpp"
#include "tools/step/step_reader.hpp"

namespace touchstone::step {
namespace {

struct Command {
    MeshChoice mesh;
    bool list = false;
    std::uint64_t bytes = 0;
    std::vector<std::string> only, files;
};

double numberOf(const std::string& text) {
    double value = 0;
    if (std::from_chars(text.data(), text.data() + text.size(), value).ec != std::errc())
        throw std::runtime_error("'" + text + "' is not a number");
    return value;
}

Command commandOf(int count, char** words) {
    Command command;
    for (int i = 1; i < count; ++i) {
        const std::string word = words[i];
        const auto next = [&]() -> std::string {
            if (++i >= count) throw std::runtime_error(word + " needs a value");
            return words[i];
        };
        if (word == "--list")
            command.list = true;
        else if (word == "--in-step")
            command.mesh.inStep = true;
        else if (word == "--keep-clearance")
            command.mesh.keepClearance = true;
        else if (word == "--deviation")
            command.mesh.deviation = numberOf(next());
        else if (word == "--bytes")
            command.bytes = std::uint64_t(numberOf(next()));
        else if (word == "--only")
            command.only.push_back(next());
        else if (word.starts_with("--"))
            throw std::runtime_error("there is no option " + word + ": touchstone starts this program by itself");
        else
            command.files.push_back(word);
    }
    if (command.files.empty())
        throw std::runtime_error(
            "no file is named: use touchstone new or touchstone validate, which start this program");
    return command;
}

void report(const std::string& what, double fraction) {
    static std::pair<std::string, int> last;
    std::pair<std::string, int> now(what, int(fraction * 1000));
    if (now == last) return;
    last = std::move(now);
    std::fprintf(stderr, "progress %.3f %s\n", fraction, what.c_str());
}

void writeAll(int handle, const std::string& bytes) {
    for (std::size_t at = 0; at < bytes.size();) {
        const ssize_t written = write(handle, bytes.data() + at, bytes.size() - at);
        if (written <= 0) throw std::runtime_error("the result cannot be passed on");
        at += std::size_t(written);
    }
}

/// Ends this process with SIGXCPU after so many seconds of the processor; never if they are negative.
void limitTime(double seconds) {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    rlimit limit{};
    getrlimit(RLIMIT_CPU, &limit);
    limit.rlim_cur =
        seconds < 0 ? limit.rlim_max : rlim_t(double(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + seconds);
    setrlimit(RLIMIT_CPU, &limit);
}

/// Open Cascade reads a megabyte in 1 to 3 s, and never ends with some malformed files.
double secondsToRead(const std::string& file) {
    constexpr double kLeast = 20, kPerByte = 10e-6;
    std::error_code error;
    const auto bytes = std::filesystem::file_size(file, error);
    return kLeast + (error ? 0 : kPerByte * double(bytes));
}

void run(const Command& command, int output) {
    if (command.bytes > 0) {
        const rlimit limit{command.bytes, command.bytes};
        setrlimit(RLIMIT_AS, &limit);
    }
    std::vector<StepContent> contents;
    std::vector<engine::CadAssembly> assemblies;
    const double share = command.list ? 1 : 0.3;
    for (std::size_t i = 0; i < command.files.size(); ++i) {
        limitTime(secondsToRead(command.files[i]));
        contents.push_back(readContent(command.files[i], [&](const std::string& what, double fraction) {
            report(what, share * (double(i) + fraction) / double(command.files.size()));
        }));
        assemblies.push_back(std::move(contents.back().assembly));
    }
    limitTime(-1);
    findClearances(assemblies);
    const auto wanted = [&](const engine::CadPart& part) {
        return command.only.empty() || std::ranges::any_of(command.only, [&](const std::string& name) {
                   return name == part.name || name == part.path;
               });
    };
    if (!command.list)
        for (std::size_t i = 0; i < assemblies.size(); ++i) {
            std::vector<std::string> nameOf(assemblies[i].shapes.size());
            for (const engine::CadPart& part : assemblies[i].parts)
                if (wanted(part)) nameOf[part.shape] = part.name;
            for (std::size_t k = 0; k < nameOf.size(); ++k) {
                if (nameOf[k].empty() || contents[i].solids[k].IsNull()) continue;
                const double done = (double(i) + double(k) / double(nameOf.size())) / double(assemblies.size());
                report("triangulating " + nameOf[k], share + (1 - share) * done);
                makeMesh(contents[i].solids[k], command.mesh, assemblies[i].shapes[k]);
            }
        }
    writeAll(output, engine::cadBytes(assemblies));
    report("done", 1);
}

}  // namespace
}  // namespace touchstone::step

int main(int count, char** words) {
    using namespace touchstone::step;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    // Open Cascade writes messages to standard output.
    const int output = dup(STDOUT_FILENO);
    dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
    Message::DefaultMessenger()->ChangePrinters().Clear();
    std::string error;
    try {
        run(commandOf(count, words), output);
        std::fflush(stderr);
        _exit(0);  // taking down what Open Cascade keeps would take longer than to make it
    } catch (const std::bad_alloc&) {
        error = "memory";
    } catch (const Standard_Failure& failure) {
        const bool memory = std::strstr(failure.DynamicType()->Name(), "OutOfMemory");
        error = memory ? "memory" : std::string("Open Cascade fails: ") + failure.GetMessageString();
    } catch (const std::exception& failure) {
        error = failure.what();
    }
    std::fprintf(stderr, "error %s\n", error.c_str());
    return 1;
}

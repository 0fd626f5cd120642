// Demonstrations in files of other programs: export, proof by replay, and every kind of damage.
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_write.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/exchange/demonstration_file.hpp"
#include "haptics/sandbox/exchange/exchange.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/random.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::exchange_tests {

using namespace touchstone::test;
namespace fs = std::filesystem;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

std::string bytesOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

void replaceIn(const fs::path& file, const std::string& what, const std::string& by) {
    std::string text = bytesOf(file);
    const auto at = text.find(what);
    REQUIRE(at != text.npos);
    text.replace(at, what.size(), by);
    writeFile(file, "the file", text);
}

/// A recording of 300 ticks, with contact from tick 140 on, whose scene has its mesh in a file of its own.
struct Push {
    TempFolder folder;
    fs::path scene = folder.path() / "scene" / "press.gltf", mesh = folder.path() / "scene" / "parts" / "press.bin",
             recording = folder.path() / "push";
    Push() {
        const fs::path glb = folder.path() / "press.glb";
        engine::writeGltf(pressScene(), glb);
        const engine::GltfContainer container = engine::readContainer(glb);
        json document = json::parse(container.json);
        document["buffers"][0]["uri"] = "parts/press.bin";
        fs::create_directories(mesh.parent_path());
        writeFile(scene, "the scene", document.dump());
        writeFile(mesh, "the mesh", {reinterpret_cast<const char*>(container.bin.data()), container.bin.size()});
        const sandbox::HapticScene opened = sandbox::openScene(scene);
        sandbox::HeadlessOptions options;
        options.timing = false;
        options.seconds = 0.3;
        options.record = recording;
        sandbox::runHeadless(opened, opened.settings, options);
    }
    fs::path file(const std::string& format, bool carryScenes = true) const {
        const fs::path made = folder.path() / ("push." + format);
        sandbox::ExportRequest request{.recordings = {recording}, .hdf5 = {}, .mcap = {}, .carryScenes = carryScenes};
        (format == "hdf5" ? request.hdf5 : request.mcap) = made;
        sandbox::exportDemonstrations(request);
        return made;
    }
    /// Adds to a number in ticks.npy.
    void addTo(const char* column, std::size_t row, double value) const {
        std::string bytes = bytesOf(recording / "ticks.npy");
        std::size_t at = bytes.size() - (300 - row) * sandbox::tickRowBytes();
        for (const sandbox::TickField& field : sandbox::tickFields()) {
            if (std::string_view(field.name) == column) break;
            at += field.size();
        }
        double number = 0;
        std::memcpy(&number, &bytes[at], sizeof number);
        number += value;
        std::memcpy(&bytes[at], &number, sizeof number);
        writeFile(recording / "ticks.npy", "the ticks", bytes);
    }
    void otherBuild() const { replaceIn(recording / "recording.json", "\"compiler\": \"", "\"compiler\": \"XYZ "); }
};

/// The lines of a file that is confirmed.
std::string verified(const fs::path& file) {
    std::string lines;
    sandbox::verifyDemonstrations(file, {}, [&](const std::string& line) { lines += line + "\n"; });
    return lines;
}

/// The sentence of a file that is not.
std::string refusal(const fs::path& file) {
    try {
        verified(file);
    } catch (const std::exception& error) {
        const std::string what = error.what();
        CHECK(what.size() > 20);
        CHECK(what.find('\n') == what.npos);
        return what;
    }
    FAIL("it was confirmed");
    return {};
}

/// Changes bytes of a file in place.
void patch(const fs::path& file, std::uint64_t at, const std::string& bytes) {
    std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
    out.seekp(static_cast<std::streamoff>(at));
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    REQUIRE(out.good());
}

}  // namespace

TEST_CASE("exchange: what was exported is confirmed without the recording and its scene", "[sandbox][exchange]") {
    const Push push;
    CHECK_THAT(verified(push.recording), Contains("300 ticks, all with the recorded bits; penetration at most"));
    for (const std::string format : {"hdf5", "mcap"}) {
        const fs::path file = push.file(format), moved = push.folder.path() / ("moved." + format);
        fs::rename(file, moved);
        const TempFolder elsewhere;
        fs::rename(push.scene.parent_path(), elsewhere.path() / "scene");
        CHECK_THAT(verified(moved), Contains("demo_0: press, 300 ticks, all with the recorded bits"));
        fs::rename(elsewhere.path() / "scene", push.scene.parent_path());
    }
}

TEST_CASE("exchange: the parts of both formats are the recording's bytes", "[sandbox][exchange]") {
    const Push push;
    const std::string npy = bytesOf(push.recording / "ticks.npy");
    for (const std::string format : {"hdf5", "mcap"}) {
        const sandbox::DemonstrationFile file(push.file(format));
        const std::string_view rows = file.part("data/demo_0/ticks");
        CHECK(rows.size() == 300 * sandbox::tickRowBytes());
        CHECK(npy.substr(npy.size() - rows.size()) == rows);
        CHECK(file.part("data/demo_0/recording.json") == bytesOf(push.recording / "recording.json"));
        const auto scene = file.manifest()["demonstrations"][0]["scene_hash"].get<std::string>();
        CHECK(file.part("files/" + scene + "/press.gltf") == bytesOf(push.scene));
        CHECK(file.part("files/" + scene + "/parts/press.bin") == bytesOf(push.mesh));
    }
}

TEST_CASE("exchange: every changed byte is found", "[sandbox][exchange]") {
    const Push push;
    Random random(22);
    for (const std::string format : {"hdf5", "mcap"}) {
        const fs::path file = push.file(format);
        const std::string bytes = bytesOf(file);
        // The ends with everything that gives places, every 61st byte between, and what changes several bytes.
        std::vector<std::size_t> places;
        for (std::size_t i = 0; i < bytes.size(); i += i < 700 || i + 700 > bytes.size() ? 1 : 613) places.push_back(i);
        for (const std::size_t at : places) {
            const char flipped = static_cast<char>(bytes[at] ^ (1 << static_cast<int>(random.engine() % 8)));
            patch(file, at, std::string(1, flipped));
            INFO(format << ", byte " << at << " of " << bytes.size());
            std::string what;
            try {
                sandbox::DemonstrationFile damaged(file);
            } catch (const std::exception& error) {
                what = error.what();
            }
            CHECK(what.size() > 20);
            CHECK(what.find('\n') == what.npos);
            patch(file, at, std::string(1, bytes[at]));
        }
        CHECK_NOTHROW(verified(file));
        for (std::size_t size = 0; size < bytes.size(); size += size < 700 ? 7 : 4999) {
            fs::resize_file(file, size);
            INFO(format << ", cut off after " << size);
            CHECK_THAT(refusal(file), Contains("cut off") || Contains("not a file that"));
            patch(file, size, bytes.substr(size));
        }
        patch(file, bytes.size(), "more");
        CHECK_THAT(refusal(file), Contains("added after the export") || Contains("changed"));
    }
}

TEST_CASE("exchange: the sentence says what was changed", "[sandbox][exchange]") {
    const Push push;
    for (const std::string format : {"hdf5", "mcap"}) {
        const fs::path file = push.file(format);
        const std::string bytes = bytesOf(file);
        const std::string rows = bytesOf(push.recording / "ticks.npy");
        const auto changed = [&](const std::string& what, std::size_t after, const std::string& by) {
            const std::size_t at = bytes.find(what);
            REQUIRE(at != bytes.npos);
            patch(file, at + after, by);
            const std::string sentence = refusal(file);
            patch(file, at, bytes.substr(at, what.size() + after + by.size()));
            return sentence;
        };
        const std::string row = rows.substr(rows.size() - 100 * sandbox::tickRowBytes(), sandbox::tickRowBytes());
        CHECK_THAT(changed(row, 300, "\1\2\3"), Contains("data/demo_0/ticks was changed") && Contains("row 200"));
        CHECK_THAT(changed(bytesOf(push.mesh), 40, "\1\2\3"), Contains("press.bin in it was changed"));
        CHECK_THAT(changed("\"stiffness\": \"1\",\n  \"torsion\"", 14, "2"),
                   Contains("recording.json was changed") && Contains("the setting stiffness"));
        CHECK_THAT(changed("\"format\": \"touchstone demonstrations\"", 12, "T"), Contains("manifest"));
        if (format == "hdf5") {
            const sandbox::DemonstrationFile whole(file);
            const std::string actions(whole.part("data/demo_0/actions").substr(0, 4096));
            CHECK_THAT(changed(actions, 100, "\1\2\3"), Contains("data/demo_0/actions was changed"));
            CHECK_THAT(changed("num_samples", 2, "M"), Contains("its structure"));
        } else {
            CHECK_THAT(changed("{\"timestamp\":{\"sec\"", 3, "T"), Contains("messages/0 was changed"));
        }
        fs::resize_file(file, bytes.size() / 2);
        CHECK_THAT(refusal(file), Contains("cut off"));
    }
}

TEST_CASE("exchange: a recording that does not repeat is neither confirmed nor exported", "[sandbox][exchange]") {
    const Push push;
    const auto refusedBoth = [&](const std::string& part) {
        CHECK_THAT(refusal(push.recording), Contains(part));
        for (const std::string format : {"hdf5", "mcap"}) {
            CHECK_THROWS_WITH(push.file(format), Contains(part));
            CHECK_FALSE(fs::exists(push.folder.path() / ("push." + format)));
        }
    };
    SECTION("a changed result, by little") {
        push.addTo("tool_x_mm", 57, 1e-9);
        refusedBoth("row 57 differs from its replay: tool_x_mm is");
    }
    SECTION("a changed input") {
        push.addTo("input_y_mm", 250, -0.01);
        refusedBoth("row 250 differs from its replay");
    }
    SECTION("a changed setting") {
        replaceIn(push.recording / "recording.json", "\"solver\": \"dual-active-set\"", "\"solver\": \"pqp\"");
        refusedBoth("differs from its replay");
    }
    SECTION("a changed mesh") {
        std::string mesh = bytesOf(push.mesh);
        mesh[3] = static_cast<char>(mesh[3] ^ 1);
        writeFile(push.mesh, "the mesh", mesh);
        refusedBoth("the mesh of the tool differs");
    }
    SECTION("a scene that is gone") {
        fs::remove(push.scene);
        refusedBoth("is missing");
    }
    SECTION("a scene file that was changed elsewhere is refused by the export alone") {
        writeFile(push.scene, "the scene", bytesOf(push.scene) + "\n");
        CHECK_NOTHROW(verified(push.recording));
        CHECK_THROWS_WITH(push.file("hdf5"), Contains("was changed since") && Contains("content hash"));
    }
}

TEST_CASE("exchange: another build is confirmed within the tolerance", "[sandbox][exchange]") {
    const Push push;
    push.otherBuild();
    CHECK_THAT(verified(push.recording), Contains("all with the recorded bits (the program's compiler was XYZ"));
    push.addTo("tool_x_mm", 57, 1e-9);
    push.addTo("force_x_N", 200, 1e-8);
    const auto within = [](const std::string& line) {
        CHECK_THAT(line, Contains("298 of them with the recorded bits") &&
                             Contains("row 57 is the first that differs: tool_x_mm") &&
                             Contains("largest deviation 1e-09 mm, 0 rad, 1e-08 N, 0 mN·m"));
    };
    within(verified(push.recording));
    for (const std::string format : {"hdf5", "mcap"}) within(verified(push.file(format)));
    push.addTo("force_x_N", 200, 1e-5);
    CHECK_THAT(refusal(push.recording),
               Contains("row 57") && Contains("1e-05 N") && Contains("more than another build explains"));
}

TEST_CASE("exchange: a mesh that another build made from the same file is judged by the tolerance",
          "[sandbox][exchange]") {
    const Push push;
    replaceIn(push.recording / "recording.json", "\"surface\": \"", "\"surface\": \"0");
    CHECK_THAT(refusal(push.recording), Contains("the mesh of the tool differs"));
    push.otherBuild();
    CHECK_THAT(verified(push.recording), Contains("300 ticks, all with the recorded bits"));
    std::string mesh = bytesOf(push.mesh);
    mesh[3] = static_cast<char>(mesh[3] ^ 1);
    writeFile(push.mesh, "the mesh", mesh);
    replaceIn(push.scene, "\"asset\"", "\"asset\" ");
    CHECK_THAT(refusal(push.recording), Contains("the mesh of the tool differs"));
}

TEST_CASE("exchange: what a file shows follows from its ticks", "[sandbox][exchange]") {
    const Push push;
    sandbox::SceneShelf scenes;
    sandbox::Demonstration demo = sandbox::replayDemonstration(push.recording, "demo_0", scenes);
    const json files = json::parse(sandbox::DemonstrationFile(push.file("mcap")).manifest().dump());
    const auto written = [&](const std::string& format) {
        const fs::path file = push.folder.path() / ("forged." + format);
        const auto writer = format == "hdf5" ? sandbox::makeHdf5Writer(file) : sandbox::makeMcapWriter(file);
        for (const sandbox::SceneFile& part : sandbox::sceneFiles(push.scene))
            writer->addFile(sandbox::partOf(part), bytesOf(part.place));
        writer->add(demo);
        nlohmann::ordered_json manifest = files;
        writer->finish(manifest);
        return file;
    };
    for (const std::string format : {"hdf5", "mcap"}) CHECK_NOTHROW(verified(written(format)));
    demo.inGoal[10] = true;
    CHECK_THAT(refusal(written("hdf5")), Contains("data/demo_0/rewards does not follow from the ticks"));
    CHECK_THAT(refusal(written("mcap")), Contains("messages/0 does not follow from the ticks"));
    demo.inGoal[10] = false;
    demo.chain[20] ^= 1;
    for (const std::string format : {"hdf5", "mcap"})
        CHECK_THAT(refusal(written(format)), Contains("data/demo_0/chain does not follow"));
}

TEST_CASE("exchange: a scene that is only named is found by its hash", "[sandbox][exchange]") {
    const Push push;
    for (const std::string format : {"hdf5", "mcap"}) {
        const fs::path file = push.file(format, false);
        CHECK(fs::file_size(file) > 100'000);
        CHECK_FALSE(bytesOf(file).find(bytesOf(push.mesh)) != std::string::npos);
        CHECK_NOTHROW(verified(file));
        const TempFolder elsewhere;
        fs::rename(push.scene.parent_path(), elsewhere.path() / "scene");
        CHECK_THAT(refusal(file),
                   Contains("press.gltf (content hash ") && Contains("is missing") && Contains("beside it"));
        fs::copy(elsewhere.path() / "scene", push.folder.path(), fs::copy_options::recursive);
        CHECK_NOTHROW(verified(file));
        replaceIn(push.folder.path() / "press.gltf", "\"asset\"", "\"asset\" ");
        CHECK_THAT(refusal(file), Contains("press.gltf' was changed") && Contains("content hash"));
        fs::copy(elsewhere.path() / "scene", push.folder.path(),
                 fs::copy_options::recursive | fs::copy_options::overwrite_existing);
        fs::remove(push.folder.path() / "parts" / "press.bin");
        CHECK_THAT(refusal(file), Contains("parts/press.bin (content hash ") && Contains("is missing"));
        fs::remove(push.folder.path() / "press.gltf");
        fs::rename(elsewhere.path() / "scene", push.scene.parent_path());
    }
}

TEST_CASE("exchange: a full disk leaves the earlier file and nothing else", "[sandbox][exchange]") {
    const Push push;
    const TempFolder target;
    for (const std::string format : {"hdf5", "mcap"})
        for (const rlim_t bytes : {0, 600, 4'000, 100'000, 200'000}) {
            const fs::path file = target.path() / ("push." + format);
            writeFile(file, "the file", "earlier");
            sandbox::ExportRequest request{.recordings = {push.recording}, .hdf5 = {}, .mcap = {}};
            (format == "hdf5" ? request.hdf5 : request.mcap) = file;
            INFO(format << ", room for " << bytes);
            {
                const FileSizeLimit limit(bytes);
                CHECK_THROWS_WITH(sandbox::exportDemonstrations(request), Contains("cannot write the demonstrations") &&
                                                                              Contains("push." + format) &&
                                                                              Contains("File too large"));
            }
            CHECK(bytesOf(file) == "earlier");
            CHECK(std::distance(fs::directory_iterator(target.path()), {}) == 1);
            fs::remove(file);
        }
}

TEST_CASE("exchange: other files are refused by name", "[sandbox][exchange]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "file";
    for (const std::string& bytes :
         {std::string(), std::string("text"), std::string("\x89HDF\r\n\x1a\n", 8),
          std::string(512, '\0') + "\x89HDF\r\n\x1a\n" + std::string(600, '\0'),
          std::string("\x89MCAP0\r\n\x89MCAP0\r\n", 16), std::string("\x89MCAP0\r\n", 8), std::string(10'000, 'x')}) {
        writeFile(file, "the file", bytes);
        CHECK_THAT(refusal(file), Contains(file.string()));
    }
    CHECK_THAT(refusal(folder.path() / "none"), Contains("none"));
    CHECK_THAT(refusal(folder.path()), Contains("recording"));
}

}  // namespace touchstone::exchange_tests

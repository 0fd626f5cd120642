// Arbitrary bytes as a file of demonstrations. If the first byte is 'F', the rest is the file, HDF5 or MCAP. Otherwise
// the texts and ticks in it are arbitrary and its checksums are right, as in a file that was made to mislead: two
// numbers of four bytes give the lengths of the manifest and of recording.json, the rest is rows.
#include "haptics/sandbox/exchange/demonstration_file.hpp"
#include "haptics/sandbox/exchange/exchange.hpp"
#include "haptics/sandbox/record/tick_fields.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;

namespace {

namespace fs = std::filesystem;

fs::path misleading(const std::uint8_t* data, std::size_t size, bool hdf5) {
    static const fuzz::ScratchFile file(".demo");
    static const auto scene = sandbox::sceneFiles(TOUCHSTONE_SOURCE_DIR "/scenes/hello.gltf");
    fuzz::Bytes bytes(data, size);
    const std::size_t manifest = std::min<std::size_t>(bytes.take<std::uint32_t>() % 65536, size);
    const std::size_t notes = std::min<std::size_t>(bytes.take<std::uint32_t>() % 65536, size);
    const std::string rest(reinterpret_cast<const char*>(data) + (size - bytes.left()), bytes.left());
    sandbox::Demonstration demo;
    demo.name = "demo_0";
    demo.notes = rest.substr(std::min(manifest, rest.size()), notes);
    demo.rows = rest.substr(std::min(manifest + notes, rest.size()));
    demo.rows.resize(demo.rows.size() / sandbox::tickRowBytes() * sandbox::tickRowBytes());
    demo.chain = sandbox::chainOf(demo.notes, demo.rows);
    for (std::size_t i = 0; i < demo.ticks(); ++i) demo.time.push_back(static_cast<double>(i));
    demo.inGoal.assign(demo.ticks(), false);
    demo.scenes.resize(1);
    const auto writer = hdf5 ? sandbox::makeHdf5Writer(file.path()) : sandbox::makeMcapWriter(file.path());
    for (const sandbox::SceneFile& part : scene)
        writer->addFile(sandbox::partOf(part), sandbox::MappedFile(part.place).bytes());
    writer->add(demo);
    auto read = nlohmann::ordered_json::parse(rest.substr(0, manifest), nullptr, false);
    if (read.is_discarded()) read = nullptr;
    // What the writer itself needs of it.
    if (!read.is_object()) read = nlohmann::ordered_json::object();
    read["program"] = {{"version", ""}, {"commit", ""}, {"compiler", ""}, {"flags", ""}};
    nlohmann::ordered_json demos = read.contains("demonstrations") ? read["demonstrations"] : nullptr;
    for (auto& entry : demos)
        if (!entry.is_object() || !entry.contains("name") || !entry["name"].is_string() || !entry.contains("scene") ||
            !entry["scene"].is_string() || !entry.contains("ticks") || !entry["ticks"].is_number_unsigned() ||
            !entry.contains("chain") || !entry["chain"].is_string())
            entry = {{"name", "demo_0"}, {"scene", ""}, {"ticks", 0}, {"chain", ""}};
    read["demonstrations"] = demos;
    writer->finish(read);
    return file.path();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFile whole(".file");
    if (size == 0) return 0;
    try {
        const fs::path file =
            *data == 'F' ? whole.write(data + 1, size - 1) : misleading(data + 1, size - 1, *data % 2);
        sandbox::verifyDemonstrations(file, {}, [](const std::string& line) { fuzz::requireSentence(line); });
    } catch (const std::exception& error) {
        fuzz::requireSentence(error.what());
    }
    return 0;
}

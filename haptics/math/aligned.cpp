#include "haptics/math/aligned.hpp"

#include <cstdlib>

#ifdef __unix__
#include <sys/mman.h>
#endif

namespace touchstone {
namespace {

constexpr std::size_t kLine = 64;
constexpr std::size_t kLarge = 1 << 15;  // bytes: a smaller block is not worth pages of its own

/// In the line before the array.
struct Header {
    void* block;
    std::size_t mapped;  ///< bytes; 0: from the heap
};
static_assert(sizeof(Header) <= kLine);

void* afterHeader(void* block, std::size_t mapped) {
    if (!block) throw std::bad_alloc();
    const auto lines = (reinterpret_cast<std::uintptr_t>(block) + 2 * kLine - 1) / kLine * kLine;
    reinterpret_cast<Header*>(lines - kLine)[0] = {block, mapped};
    return reinterpret_cast<void*>(lines);
}

}  // namespace

void* allocateLines(std::size_t bytes) {
    const std::size_t all = bytes + 2 * kLine;
#ifdef __unix__
    // The heap's zeroed memory is not used: where it grows, half of each array would be written.
    if (PagesOnDemand::active() && bytes >= kLarge) {
        void* pages = ::mmap(nullptr, all, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        return afterHeader(pages == MAP_FAILED ? nullptr : pages, all);
    }
#endif
    return afterHeader(PagesOnDemand::active() ? std::calloc(1, all) : std::malloc(all), 0);
}

void freeLines(void* lines) {
    if (!lines) return;
    const Header header = reinterpret_cast<Header*>(static_cast<char*>(lines) - kLine)[0];
#ifdef __unix__
    if (header.mapped > 0) {
        ::munmap(header.block, header.mapped);
        return;
    }
#endif
    std::free(header.block);
}

}  // namespace touchstone

#include "haptics/threads/triple_buffer.hpp"

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>

#include "haptics/threads/mailbox.hpp"

namespace touchstone::triple_buffer_tests {

TEST_CASE("triple buffer: the reader sees the initial value, then only the newest", "[loop]") {
    TripleBuffer<int> buffer(7);
    CHECK_FALSE(buffer.update());
    CHECK(buffer.get() == 7);
    buffer.write(1);
    CHECK(buffer.get() == 7);  // not before update()
    CHECK(buffer.update());
    CHECK(buffer.get() == 1);
    CHECK_FALSE(buffer.update());
    for (int i = 2; i <= 10; ++i) buffer.write(i);
    CHECK(buffer.update());
    CHECK(buffer.get() == 10);
    CHECK_FALSE(buffer.update());
    CHECK(buffer.get() == 10);
}

TEST_CASE("triple buffer: under a fast writer no value is torn, no old value returns, and the last arrives",
          "[loop][thread]") {
    constexpr std::uint64_t kWrites = 100'000;
    using Value = std::array<std::uint64_t, 32>;  // several cache lines
    TripleBuffer<Value> buffer;
    std::thread writer([&] {
        Value value;
        for (std::uint64_t i = 1; i <= kWrites; ++i) {
            value.fill(i);
            buffer.write(value);
        }
    });
    std::uint64_t last = 0;
    bool whole = true, forward = true;
    while (last < kWrites) {
        if (!buffer.update()) {
            std::this_thread::yield();
            continue;
        }
        const Value& value = buffer.get();
        for (const std::uint64_t word : value) whole &= word == value[0];
        forward &= value[0] > last;
        last = value[0];
    }
    writer.join();
    CHECK(whole);
    CHECK(forward);
}

namespace {

/// Counts the live objects.
struct Counted {
    explicit Counted(int v) : value(v) { ++living; }
    ~Counted() { --living; }
    int value;
    static inline std::atomic<int> living = 0;
};

}  // namespace

TEST_CASE("mailbox: a newer object replaces an object that was not taken, and nothing leaks", "[loop]") {
    {
        Mailbox<Counted> box;
        CHECK(box.empty());
        CHECK(box.take() == nullptr);
        CHECK(box.put(std::make_unique<Counted>(1)) == nullptr);
        const auto replaced = box.put(std::make_unique<Counted>(2));
        REQUIRE(replaced);
        CHECK(replaced->value == 1);
        CHECK(box.take()->value == 2);
        CHECK(box.empty());
        box.put(std::make_unique<Counted>(3));
    }
    CHECK(Counted::living == 0);
}

TEST_CASE("mailbox: each object that passes between threads is freed exactly once", "[loop][thread]") {
    constexpr int kObjects = 20'000;
    {
        Mailbox<Counted> box;
        std::atomic<bool> done = false;
        std::thread sender([&] {
            for (int i = 1; i <= kObjects; ++i) box.put(std::make_unique<Counted>(i));
            done = true;
        });
        int last = 0;
        bool forward = true;
        for (bool finished = false; !finished;) {
            finished = done;
            if (const auto object = box.take()) {
                forward &= object->value > last;
                last = object->value;
            } else {
                std::this_thread::yield();
            }
        }
        sender.join();
        CHECK(forward);
        CHECK(last == kObjects);
    }
    CHECK(Counted::living == 0);
}

}  // namespace touchstone::triple_buffer_tests

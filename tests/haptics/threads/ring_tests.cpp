#include "haptics/threads/ring.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>

namespace touchstone::ring_tests {

TEST_CASE("ring: values come out in the order they went in, over many wraps", "[loop]") {
    Ring<int> ring(5);
    CHECK(ring.capacity() == 8);
    int next = 0, expected = 0, value = 0;
    CHECK_FALSE(ring.pop(value));
    for (int round = 0; round < 100; ++round) {
        for (int i = 0; i < 1 + round % 8; ++i) REQUIRE(ring.push(next++));
        while (ring.pop(value)) REQUIRE(value == expected++);
    }
    CHECK(expected == next);
    CHECK(ring.dropped() == 0);
}

TEST_CASE("ring: a full ring drops the newest, counts it and keeps the rest", "[loop]") {
    Ring<int> ring(4);
    for (int i = 0; i < 4; ++i) CHECK(ring.push(i));
    CHECK_FALSE(ring.push(4));
    CHECK_FALSE(ring.push(5));
    CHECK(ring.dropped() == 2);
    int value = -1;
    CHECK(ring.pop(value));
    CHECK(value == 0);
    CHECK(ring.push(6));
    for (const int expected : {1, 2, 3, 6}) {
        CHECK(ring.pop(value));
        CHECK(value == expected);
    }
    CHECK_FALSE(ring.pop(value));
    CHECK(ring.dropped() == 2);
}

TEST_CASE("ring: between two threads every value arrives once and in order, or is counted as dropped",
          "[loop][thread]") {
    constexpr std::uint64_t kValues = 200'000;
    struct Value {
        std::uint64_t number = 0, copy[9] = {};
    };
    Ring<Value> ring(64);
    std::thread producer([&] {
        for (std::uint64_t i = 1; i <= kValues; ++i) {
            Value value{.number = i};
            for (std::uint64_t& c : value.copy) c = i;
            ring.push(value);
            if (i % 64 == 0) std::this_thread::yield();
        }
        // The last value must arrive, so only this one is retried; its refusals also count as drops.
        while (!ring.push({.number = kValues + 1})) std::this_thread::yield();
    });
    std::uint64_t received = 0, last = 0;
    bool whole = true, forward = true;
    while (true) {
        Value value;
        if (!ring.pop(value)) {
            std::this_thread::yield();
            continue;
        }
        if (value.number > kValues) break;
        for (const std::uint64_t c : value.copy) whole &= c == value.number;
        forward &= value.number > last;
        last = value.number;
        ++received;
    }
    producer.join();
    CHECK(whole);
    CHECK(forward);
    CHECK(received + ring.dropped() >= kValues);  // refusals of the last value may add to it
    CHECK(received <= kValues);
}

}  // namespace touchstone::ring_tests

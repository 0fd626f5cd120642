#include "engine/scene/registry.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <string>

namespace touchstone::registry_tests {

using touchstone::engine::Entity;
using touchstone::engine::Registry;

namespace {
struct Mass {
    double kilograms = 0;
};
struct Tag {
    std::string text;
};
}  // namespace

TEST_CASE("registry: a null entity is dead and has no components", "[registry]") {
    Registry registry;
    const Entity null;
    CHECK_FALSE(null);
    CHECK_FALSE(registry.alive(null));
    CHECK(registry.find<Mass>(null) == nullptr);
    registry.destroy(null);
    registry.remove<Mass>(null);
    CHECK(registry.size() == 0);
}

TEST_CASE("registry: a stale handle does not reach the new owner of its index", "[registry]") {
    Registry registry;
    const Entity old = registry.create();
    registry.add(old, Mass{1});
    registry.destroy(old);
    const Entity young = registry.create();
    registry.add(young, Mass{2});
    REQUIRE(young.index == old.index);
    CHECK(young != old);
    CHECK_FALSE(registry.alive(old));
    CHECK(registry.find<Mass>(old) == nullptr);
    registry.remove<Mass>(old);
    registry.destroy(old);
    CHECK(registry.alive(young));
    CHECK(registry.get<Mass>(young).kilograms == 2);
}

TEST_CASE("registry: adding a component again replaces it", "[registry]") {
    Registry registry;
    const Entity entity = registry.create();
    registry.add(entity, Tag{"first"});
    registry.add(entity, Tag{"second"});
    CHECK(registry.get<Tag>(entity).text == "second");
    int count = 0;
    registry.each<Tag>([&](Entity, Tag&) { ++count; });
    CHECK(count == 1);
}

TEST_CASE("registry: removal leaves the others untouched", "[registry]") {
    Registry registry;
    const Entity a = registry.create(), b = registry.create(), c = registry.create();
    registry.add(a, Tag{"a"});
    registry.add(b, Tag{"b"});
    registry.add(c, Tag{"c"});
    registry.add(b, Mass{3});
    registry.remove<Tag>(a);
    CHECK_FALSE(registry.has<Tag>(a));
    CHECK(registry.alive(a));
    CHECK(registry.get<Tag>(b).text == "b");
    CHECK(registry.get<Tag>(c).text == "c");
    registry.destroy(b);
    CHECK_FALSE(registry.has<Mass>(b));
    CHECK(registry.get<Tag>(c).text == "c");
    CHECK(registry.size() == 2);
}

TEST_CASE("registry: iteration visits the entities that have all components, in order of addition", "[registry]") {
    Registry registry;
    std::vector<Entity> wanted;
    for (int i = 0; i < 10; ++i) {
        const Entity entity = registry.create();
        registry.add(entity, Mass{double(i)});
        if (i % 3 == 0) {
            registry.add(entity, Tag{std::to_string(i)});
            wanted.push_back(entity);
        }
    }
    std::vector<Entity> visited;
    registry.each<Mass, Tag>([&](Entity entity, Mass& mass, Tag& tag) {
        CHECK(tag.text == std::to_string(int(mass.kilograms)));
        visited.push_back(entity);
    });
    CHECK(visited == wanted);
    const Registry& constant = registry;
    int count = 0;
    constant.each<Tag>([&](Entity, const Tag&) { ++count; });
    CHECK(count == 4);
}

TEST_CASE("registry: an entity may be destroyed while it is visited, and all others are visited once", "[registry]") {
    Registry registry;
    for (int i = 0; i < 20; ++i) registry.add(registry.create(), Mass{double(i)});
    std::vector<int> seen(20);
    registry.each<Mass>([&](Entity entity, Mass& mass) {
        ++seen[std::size_t(mass.kilograms)];
        if (int(mass.kilograms) % 2 == 0) registry.destroy(entity);
    });
    CHECK(seen == std::vector<int>(20, 1));
    CHECK(registry.size() == 10);
}

TEST_CASE("registry: random use agrees with a model of maps", "[registry]") {
    const unsigned seed = 20240611;
    CAPTURE(seed);
    std::mt19937 random(seed);
    Registry registry;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::map<int, double>>
        model;                    // entity -> component type -> value
    std::vector<Entity> handles;  // live and stale
    for (int step = 0; step < 20000; ++step) {
        const auto pick = [&] { return handles[random() % handles.size()]; };
        const int action = int(random() % 6);
        if (handles.empty() || action == 0) {
            handles.push_back(registry.create());
            model[{handles.back().index, handles.back().generation}];
            continue;
        }
        const Entity entity = pick();
        const auto known = model.find({entity.index, entity.generation});
        REQUIRE(registry.alive(entity) == (known != model.end()));
        if (action == 1 && random() % 2) {
            registry.destroy(entity);
            if (known != model.end()) model.erase(known);
        } else if (known != model.end() && action == 2) {
            registry.add(entity, Mass{double(step)});
            known->second[0] = step;
        } else if (known != model.end() && action == 3) {
            registry.add(entity, Tag{std::to_string(step)});
            known->second[1] = step;
        } else if (action == 4) {
            registry.remove<Mass>(entity);
            if (known != model.end()) known->second.erase(0);
        }
    }
    REQUIRE(registry.size() == model.size());
    for (const auto& [key, components] : model) {
        const Entity entity{key.first, key.second};
        REQUIRE(registry.has<Mass>(entity) == components.contains(0));
        REQUIRE(registry.has<Tag>(entity) == components.contains(1));
        if (components.contains(0)) REQUIRE(registry.get<Mass>(entity).kilograms == components.at(0));
        if (components.contains(1)) REQUIRE(registry.get<Tag>(entity).text == std::to_string(int(components.at(1))));
    }
    std::size_t both = 0;
    for (const auto& [key, components] : model) both += components.size() == 2;
    registry.each<Tag, Mass>([&](Entity, Tag&, Mass&) { --both; });
    CHECK(both == 0);
}

}  // namespace touchstone::registry_tests

#pragma once
// Sparse-set entity-component registry. Each component type has one pool: values packed densely beside their entities,
// and a sparse array from entity index to place in the pool. Lookup, adding and removal are O(1); iteration is linear.
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace touchstone::engine {

/// Handle of an entity. The generation distinguishes a stale handle from the current owner of the same index.
struct Entity {
    static constexpr std::uint32_t kNull = std::numeric_limits<std::uint32_t>::max();
    std::uint32_t index = kNull;
    std::uint32_t generation = 0;

    explicit operator bool() const { return index != kNull; }
    friend bool operator==(Entity a, Entity b) = default;
};

/// Owner of all entities and components. Move-only. A reference to a component is valid until a component of the
/// same type is added or removed. A dead or null entity has no components; adding one to it is an error of the caller.
/// Not thread-safe.
class Registry {
  public:
    Entity create() {
        if (free_.empty()) {
            generations_.push_back(0);
            alive_.push_back(true);
            return {static_cast<std::uint32_t>(generations_.size() - 1), 0};
        }
        const std::uint32_t index = free_.back();
        free_.pop_back();
        alive_[index] = true;
        return {index, generations_[index]};
    }

    /// Removes the entity with all its components; a stale or null handle is ignored.
    void destroy(Entity entity) {
        if (!alive(entity)) return;
        for (auto& pool : pools_)
            if (pool) pool->remove(entity);
        alive_[entity.index] = false;
        ++generations_[entity.index];
        free_.push_back(entity.index);
    }

    bool alive(Entity entity) const {
        return entity.index < generations_.size() && alive_[entity.index] &&
               generations_[entity.index] == entity.generation;
    }

    /// Number of living entities.
    std::size_t size() const { return generations_.size() - free_.size(); }

    /// Adds a component or replaces the existing one.
    template <class T>
    T& add(Entity entity, T value = {}) {
        assert(alive(entity));
        return pool<T>().set(entity, std::move(value));
    }

    /// The component, or null.
    template <class T>
    T* find(Entity entity) {
        Pool<T>* existing = findPool<T>();
        return existing ? existing->find(entity) : nullptr;
    }
    template <class T>
    const T* find(Entity entity) const {
        return const_cast<Registry*>(this)->find<T>(entity);
    }

    /// The component, which must exist.
    template <class T>
    T& get(Entity entity) {
        T* found = find<T>(entity);
        assert(found);
        return *found;
    }
    template <class T>
    const T& get(Entity entity) const {
        return const_cast<Registry*>(this)->get<T>(entity);
    }

    template <class T>
    bool has(Entity entity) const {
        return find<T>(entity) != nullptr;
    }

    template <class T>
    void remove(Entity entity) {
        if (Pool<T>* existing = findPool<T>()) existing->remove(entity);
    }

    /// Calls f(entity, first, others...) for each entity that has all these components. The order is that of adding
    /// First as long as none was removed; name the rarest type first. f may remove components of its own entity or
    /// destroy it. It must not add a component of a visited type or remove First from another entity.
    template <class First, class... Others, class F>
    void each(F&& f) {
        Pool<First>* first = findPool<First>();
        if (!first) return;
        for (std::size_t i = 0; i < first->entities.size();) {
            const Entity entity = first->entities[i];
            if ((has<Others>(entity) && ...)) f(entity, first->values[i], get<Others>(entity)...);
            if (i < first->entities.size() && first->entities[i] == entity) ++i;
        }
    }
    template <class First, class... Others, class F>
    void each(F&& f) const {
        const_cast<Registry*>(this)->each<First, Others...>(
            [&](Entity entity, const First& first, const Others&... others) { f(entity, first, others...); });
    }

  private:
    struct PoolBase {
        virtual ~PoolBase() = default;
        virtual void remove(Entity entity) = 0;
    };

    template <class T>
    struct Pool final : PoolBase {
        std::vector<std::uint32_t> places;  // by entity index; kNull if the entity has none
        std::vector<Entity> entities;       // packed, parallel to values
        std::vector<T> values;

        T* find(Entity entity) {
            if (entity.index >= places.size() || places[entity.index] == Entity::kNull) return nullptr;
            const std::uint32_t place = places[entity.index];
            return entities[place] == entity ? &values[place] : nullptr;
        }

        T& set(Entity entity, T value) {
            if (T* existing = find(entity)) return *existing = std::move(value);
            if (entity.index >= places.size()) places.resize(entity.index + std::size_t{1}, Entity::kNull);
            places[entity.index] = static_cast<std::uint32_t>(values.size());
            entities.push_back(entity);
            return values.emplace_back(std::move(value));
        }

        void remove(Entity entity) override {
            if (!find(entity)) return;
            const std::uint32_t place = std::exchange(places[entity.index], Entity::kNull);
            if (place + std::size_t{1} < values.size()) {
                values[place] = std::move(values.back());
                entities[place] = entities.back();
                places[entities[place].index] = place;
            }
            values.pop_back();
            entities.pop_back();
        }
    };

    template <class T>
    static std::size_t typeId() {
        static const std::size_t id = nextTypeId_++;
        return id;
    }

    template <class T>
    Pool<T>* findPool() {
        const std::size_t id = typeId<T>();
        return id < pools_.size() ? static_cast<Pool<T>*>(pools_[id].get()) : nullptr;
    }

    template <class T>
    Pool<T>& pool() {
        const std::size_t id = typeId<T>();
        if (id >= pools_.size()) pools_.resize(id + 1);
        if (!pools_[id]) pools_[id] = std::make_unique<Pool<T>>();
        return static_cast<Pool<T>&>(*pools_[id]);
    }

    inline static std::atomic<std::size_t> nextTypeId_ = 0;
    std::vector<std::uint32_t> generations_;
    std::vector<bool> alive_;
    std::vector<std::uint32_t> free_;
    std::vector<std::unique_ptr<PoolBase>> pools_;
};

}  // namespace touchstone::engine

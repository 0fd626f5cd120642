// This program counts allocations too.
#include "tests/haptics/alloc_count.cpp"

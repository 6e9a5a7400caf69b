/* A stack of memory that the caller owns. With base NULL it only counts. */
#pragma once

#include <stddef.h>
#include <stdbool.h>
#include <stdint.h>

#define SV_ALIGNMENT 64 /* bytes; the widest vector */

/* Under AddressSanitizer a forbidden gap follows each piece, or it would see one allocation only. */
#if defined __SANITIZE_ADDRESS__
#include <sanitizer/asan_interface.h>
#define SV_GAP SV_ALIGNMENT
#define SV_FORBID(address, size) ASAN_POISON_MEMORY_REGION(address, size)
#define SV_ALLOW(address, size) ASAN_UNPOISON_MEMORY_REGION(address, size)
#else
#define SV_GAP 0
#define SV_FORBID(address, size) ((void)(address), (void)(size))
#define SV_ALLOW(address, size) ((void)(address), (void)(size))
#endif

typedef struct {
    unsigned char *base;
    size_t used;
} sv_arena;

static inline sv_arena sv_arena_in(void *memory)
{
    uintptr_t address = (uintptr_t)memory;
    uintptr_t skip = memory ? (SV_ALIGNMENT - address % SV_ALIGNMENT) % SV_ALIGNMENT : 0;
    return (sv_arena){memory ? (unsigned char *)memory + skip : NULL, 0};
}

static inline void *sv_take(sv_arena *arena, size_t count, size_t size)
{
    const size_t at = arena->used, bytes = count * size;
    arena->used += (bytes + SV_GAP + SV_ALIGNMENT - 1) / SV_ALIGNMENT * SV_ALIGNMENT;
    if (!arena->base)
        return NULL;
    SV_ALLOW(arena->base + at, bytes);
    SV_FORBID(arena->base + at + bytes, arena->used - at - bytes);
    return arena->base + at;
}

/* Leaves the memory to its owner. */
static inline void sv_give_back(const sv_arena *arena)
{
    SV_ALLOW(arena->base, arena->used);
}

/* What to allocate so that the arena fits wherever it starts. */
static inline size_t sv_arena_bytes(const sv_arena *arena)
{
    return arena->used + SV_ALIGNMENT;
}

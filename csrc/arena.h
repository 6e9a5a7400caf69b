/* A stack of memory that the caller owns. With base NULL it only counts. */
#ifndef SV_ARENA_H
#define SV_ARENA_H

#include <stddef.h>
#include <stdint.h>

#define SV_ALIGNMENT 64 /* bytes; the widest vector */

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
    size_t at = arena->used;
    arena->used += (count * size + SV_ALIGNMENT - 1) / SV_ALIGNMENT * SV_ALIGNMENT;
    return arena->base ? arena->base + at : NULL;
}

/* What to allocate so that the arena fits wherever it starts. */
static inline size_t sv_arena_bytes(const sv_arena *arena)
{
    return arena->used + SV_ALIGNMENT;
}

#endif

#include "block_means.h"

#include <string.h>

static size_t size_of_sum(const SlideBlocksShape *shape) {
    return (1 + shape->count) * sizeof(double);
}

static double *sum_at(const SlideBlocksShape *shape, const SlideBlocks *blocks, size_t place) {
    return blocks->whole + place % SLIDE_BLOCKS * (1 + shape->count);
}

static void add(const SlideBlocksShape *shape, double *sum, const double *other) {
    for (size_t i = 0; i <= shape->count; ++i) {
        sum[i] += other[i];
    }
}

void slide_blocks_place(SlideBlocks *blocks, const SlideBlocksShape *shape, SlideArena *arena) {
    blocks->taken = slide_place(arena, 1, sizeof *blocks->taken);
    blocks->oldest = slide_place(arena, 1, sizeof *blocks->oldest);
    blocks->begun = slide_place(arena, 1, size_of_sum(shape));
    blocks->total = slide_place(arena, 1, size_of_sum(shape));
    blocks->whole = slide_place(arena, SLIDE_BLOCKS, size_of_sum(shape));
}

void slide_blocks_begin(const SlideBlocksShape *shape, SlideBlocks *blocks) {
    *blocks->taken = 0;
    *blocks->oldest = 0;
    memset(blocks->begun, 0, size_of_sum(shape));
    memset(blocks->total, 0, size_of_sum(shape));
    memset(blocks->whole, 0, SLIDE_BLOCKS * size_of_sum(shape));
}

/* Always in the same order, the oldest block first. */
static void sum_up(const SlideBlocksShape *shape, SlideBlocks *blocks) {
    memset(blocks->total, 0, size_of_sum(shape));
    for (size_t block = 0; block < SLIDE_BLOCKS; ++block) {
        add(shape, blocks->total, sum_at(shape, blocks, (size_t)*blocks->oldest + block));
    }
}

void slide_blocks_fill(const SlideBlocksShape *shape, SlideBlocks *blocks, const double *values) {
    slide_blocks_begin(shape, blocks);
    for (size_t block = 0; block < SLIDE_BLOCKS; ++block) {
        double *sum = sum_at(shape, blocks, block);
        sum[0] = (double)shape->length;
        for (size_t i = 0; i < shape->count; ++i) {
            sum[1 + i] = (double)shape->length * values[i];
        }
    }
    sum_up(shape, blocks);
}

/* The block that has begun is whole: it takes the place of the oldest. */
static void go_on(const SlideBlocksShape *shape, SlideBlocks *blocks) {
    memcpy(sum_at(shape, blocks, (size_t)*blocks->oldest), blocks->begun, size_of_sum(shape));
    *blocks->oldest = (*blocks->oldest + 1) % SLIDE_BLOCKS;
    sum_up(shape, blocks);
    memset(blocks->begun, 0, size_of_sum(shape));
    *blocks->taken = 0;
}

void slide_blocks_add(const SlideBlocksShape *shape, SlideBlocks *blocks, const double *values) {
    if (*blocks->taken == shape->length) {
        go_on(shape, blocks);
    }
    *blocks->taken += 1;
    if (values != NULL) {
        blocks->begun[0] += 1;
        for (size_t i = 0; i < shape->count; ++i) {
            blocks->begun[1 + i] += values[i];
        }
    }
}

void slide_blocks_means(const SlideBlocksShape *shape, const SlideBlocks *blocks, double *means) {
    const double present = blocks->total[0] + blocks->begun[0];
    const double factor = present > 0 ? 1 / present : 0;
    for (size_t i = 0; i < shape->count; ++i) {
        means[i] = (blocks->total[1 + i] + blocks->begun[1 + i]) * factor;
    }
}

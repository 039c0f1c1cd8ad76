/* Means over the last SLIDE_BLOCKS whole blocks of samples and over the block that has begun, as
 * block_means of slide_fmu/surrogate/error_bound.py. Sums are formed in the order of the samples
 * and of the blocks: from a block's begin on they are the same, bit by bit, whatever was before. */
#ifndef SLIDE_BLOCK_MEANS_H
#define SLIDE_BLOCK_MEANS_H

#include "arena.h"
#include "payload.h"

/* What does not change. */
typedef struct {
    uint64_t length; /* samples in a block */
    size_t count;    /* values of a sample */
} SlideBlocksShape;

/* What changes; part of the flat state block. A sum has the number of samples that are present,
 * then the sums of their values. */
typedef struct {
    uint64_t *taken;  /* samples in the block that has begun, present or not */
    uint64_t *oldest; /* place of the oldest whole block */
    double *begun;    /* [1 + count], sum of the block that has begun */
    double *total;    /* [1 + count], sum of the whole blocks */
    double *whole;    /* [SLIDE_BLOCKS][1 + count], sums of the whole blocks */
} SlideBlocks;

void slide_blocks_place(SlideBlocks *blocks, const SlideBlocksShape *shape, SlideArena *arena);

/* A block begins, those before it are empty. */
void slide_blocks_begin(const SlideBlocksShape *shape, SlideBlocks *blocks);

/* A block begins; in those before it, all samples had these values [count]. */
void slide_blocks_fill(const SlideBlocksShape *shape, SlideBlocks *blocks, const double *values);

/* Take in a sample's values [count]; NULL: they are absent, and left out of the means. */
void slide_blocks_add(const SlideBlocksShape *shape, SlideBlocks *blocks, const double *values);

/* The means [count]; zeros where no sample is present. */
void slide_blocks_means(const SlideBlocksShape *shape, const SlideBlocks *blocks, double *means);

#endif

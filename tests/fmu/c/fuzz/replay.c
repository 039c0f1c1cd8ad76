/* replay SEED RUNS CURRENT FILE...: runs the fuzz target on each file, then RUNS times on a file
 * changed at random, without any guidance: for compilers without libFuzzer. Each changed input is
 * written to CURRENT first, so that it is there after a crash. Prints the number of executions. */
#include "target.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROOM = 1 << 14, MOST_FILES = 4096 };

typedef struct {
    uint8_t *data;
    size_t size;
} Content;

static uint64_t seed;

/* SplitMix64. */
static uint64_t draw(void) {
    seed += 0x9E3779B97F4A7C15u;
    uint64_t z = (seed ^ seed >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

static bool read_content(const char *path, Content *content) {
    FILE *file = fopen(path, "rb");
    content->data = malloc(ROOM);
    content->size = file == NULL ? 0 : fread(content->data, 1, ROOM, file);
    return file != NULL && fclose(file) == 0;
}

static bool write_content(const char *path, const Content *content) {
    FILE *file = fopen(path, "wb");
    bool done = file != NULL && fwrite(content->data, 1, content->size, file) == content->size;
    return file != NULL && fclose(file) == 0 && done;
}

/* Some bytes changed, taken out or put in from another file. */
static void change(Content *content, const Content *other) {
    for (uint64_t left = 1 + draw() % 8; left > 0; --left) {
        const size_t place = (size_t)(draw() % (content->size + 1));
        const size_t behind = content->size - place, length = (size_t)(draw() % 16);
        switch (draw() % 4) {
        case 0:
            content->data[place] ^= (uint8_t)(behind == 0 ? 0 : 1 << draw() % 8);
            break;
        case 1:
            content->data[place] = (uint8_t)(behind == 0 ? 0 : draw());
            break;
        case 2:
            if (length <= behind) {
                memmove(content->data + place, content->data + place + length, behind - length);
                content->size -= length;
            }
            break;
        default:
            if (length < other->size && content->size + length < ROOM) {
                memmove(content->data + place + length, content->data + place, behind);
                memcpy(content->data + place, other->data + draw() % (other->size - length),
                       length);
                content->size += length;
            }
            break;
        }
    }
}

int main(int count, char **arguments) {
    static Content files[MOST_FILES];
    static uint8_t room[ROOM];
    const int n_files = count - 4;
    if (n_files < 1 || n_files > MOST_FILES) {
        fputs("replay SEED RUNS CURRENT FILE...\n", stderr);
        return 2;
    }
    seed = strtoull(arguments[1], NULL, 10);
    for (int i = 0; i < n_files; ++i) {
        if (!read_content(arguments[4 + i], &files[i])) {
            fprintf(stderr, "cannot read %s\n", arguments[4 + i]);
            return 2;
        }
        write_content(arguments[3], &files[i]);
        LLVMFuzzerTestOneInput(files[i].data, files[i].size);
    }
    const long runs = atol(arguments[2]);
    for (long left = runs; left > 0; --left) {
        const Content *file = &files[draw() % (uint64_t)n_files];
        Content changed = {room, file->size};
        memcpy(room, file->data, file->size);
        change(&changed, &files[draw() % (uint64_t)n_files]);
        if (!write_content(arguments[3], &changed)) {
            return 2;
        }
        LLVMFuzzerTestOneInput(changed.data, changed.size);
    }
    printf("%ld\n", n_files + runs);
    return 0;
}

#include "machine.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

part_t machine_part[MACHINE_PARTS_MAX];
uint32_t machine_parts;

static char second_name[MACHINE_PARTS_MAX][40];

static void add_parts(const layout_t *layout, bool second, size_t guard, size_t block) {
    for (uint32_t i = 0; (i < layout->parts) && (machine_parts < (uint32_t)MACHINE_PARTS_MAX); ++i) {
        part_t part = layout->part[i];
        part.offset += (uint32_t)(part.table ? block : guard);
        if (second) {
            (void)snprintf(second_name[machine_parts], sizeof(second_name[0]), "second.%s", part.name);
            part.name = second_name[machine_parts];
        }
        machine_part[machine_parts] = part;
        ++machine_parts;
    }
}

bool machine_has_two_channels(const machine_t *self) {
    return !guard_is_alone(&self->pair.guard);
}

/* second.c keeps the guard at the beginning of its storage, and its last output behind it. */
void machine_moved(machine_t *self, const machine_t *home) {
    first_layout()->move(&self->pair.guard, &home->block);
    if (machine_has_two_channels(home)) {
        second_layout()->move(&self->pair.second, home->second_block);
    }
}

void machine_take_counts(machine_t *self, const machine_t *other) {
    first_layout()->take_counts(&self->pair.guard, &other->pair.guard);
    if (machine_has_two_channels(other)) {
        second_layout()->take_counts(&self->pair.second, &other->pair.second);
    }
}

void machine_accept_block(machine_t *self) {
    config_watch_start(&self->pair.guard.watch, &self->block);
}

bool machine_init(machine_t *self, const guard_config_t *block, const void *second) {
    memset(self, 0, sizeof(*self));
    self->block = *block;
    if (second != NULL) {
        memcpy(self->second_block, second, sizeof(*block));
    }
    machine_parts = 0;
    add_parts(first_layout(), false, offsetof(machine_t, pair.guard), offsetof(machine_t, block));
    if (second != NULL) {
        add_parts(second_layout(), true, offsetof(machine_t, pair.second), offsetof(machine_t, second_block));
        machine_part[machine_parts] =
            (part_t){"second.out", (uint32_t)(offsetof(machine_t, pair.second) + second_layout()->guard_bytes),
                     sizeof(guard_output_t), false};
        ++machine_parts;
    }
    if (pair_init(&self->pair, &self->block, (second != NULL) ? self->second_block : NULL) != GUARD_OK) {
        return false;
    }
    pair_note_start(&self->pair, GUARD_START_POWER_ON, 0u, GUARD_VARIANT_PRODUCT);
    return true;
}

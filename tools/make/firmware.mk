# The firmware as a shared library for the host, and the declarations that cffi reads.
ROOMS := core wire wire/generated guard schedule robots
FIRMWARE_SOURCES = $(wildcard $(ROOMS:%=firmware/%/*.c))
LIBRARY_SOURCES = $(FIRMWARE_SOURCES) $(wildcard firmware/robot_side/*.c firmware/hosts/library/*.c)
LIBRARY_INCLUDES := -Ifirmware/hosts/library -Ifirmware/robot_side
INCLUDES := $(ROOMS:%=-Ifirmware/%)

# No contraction: every target computes the same bits.
CFLAGS_ALL := -std=c11 -ffp-contract=off -fno-math-errno $(INCLUDES) -MMD -MP
STRICT := -Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Werror

# Which sources a build is of: written when it changes, and seen by the files that tell it. Every object rule names it
# as an order-only prerequisite.
$(BUILD)/build_id.h: FORCE
	@mkdir -p $(@D)
	@id=$$(cat $(sort $(wildcard firmware/*/*.[chS] firmware/*/*/*.[chS] firmware/*/*/*.ld)) | sha256sum | cut -c 1-8); \
	line="#define TAUPERP_BUILD_ID 0x$${id}u"; [ "$$(cat $@ 2>/dev/null)" = "$$line" ] || echo "$$line" >$@
.PHONY: FORCE
$(BUILD)/object/%/guard_report.o $(BUILD)/object/%/identity.o: CFLAGS_ALL += -include $(BUILD)/build_id.h

# Which numbers a build is for: float is the default, fixed the same sources in Q9.22.
FLAGS_float :=
FLAGS_fixed := -DTAUPERP_FIXED=1
DIR_float := $(BUILD)
DIR_fixed := $(BUILD)/fixed
NUMERICS ?= float fixed

.PHONY: library library-fixed

library: $(BUILD)/libtauperp.so $(BUILD)/tauperp.cdef.h ## build the firmware for the host: build/libtauperp.so
library-fixed: $(BUILD)/fixed/libtauperp.so $(BUILD)/fixed/tauperp.cdef.h ## the same in fixed point: build/fixed/libtauperp.so

define LIBRARY_RULES
LIBRARY_OBJECTS_$(1) = $$(LIBRARY_SOURCES:%.c=$(BUILD)/object/library-$(1)/%.o)

$(BUILD)/object/library-$(1)/%.o: %.c tools/make/firmware.mk | $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1))'
	@$$(CC) $$(CFLAGS_ALL) $(FLAGS_$(1)) -O2 -fPIC $(LIBRARY_INCLUDES) $(STRICT) -c -o $$@ $$<

# Linked beside its name and moved: a process that has loaded the old library keeps it.
$(DIR_$(1))/libtauperp.so: $$(LIBRARY_OBJECTS_$(1))
	@mkdir -p $$(@D)
	@$$(CC) -shared -Wl,-z,defs -o $$@.new $$^
	@mv $$@.new $$@

# cffi parses declarations only: no preprocessor lines, and standard headers expand to nothing.
$(DIR_$(1))/tauperp.cdef.h: firmware/hosts/library/tauperp.h $(BUILD)/empty/stdint.h
	@mkdir -p $$(@D)
	@$$(CC) -E -P -nostdinc -std=c11 $(FLAGS_$(1)) -DTAUPERP_CDEF -I$(BUILD)/empty $(INCLUDES) $(LIBRARY_INCLUDES) -MMD -MP -MF $$(@D)/tauperp.d -MT $$@ -o $$@.new $$<
	@mv $$@.new $$@

-include $$(LIBRARY_OBJECTS_$(1):.o=.d) $(DIR_$(1))/tauperp.d
endef
$(foreach numeric,float fixed,$(eval $(call LIBRARY_RULES,$(numeric))))

$(BUILD)/empty/stdint.h:
	@mkdir -p $(@D)
	@touch $(addprefix $(@D)/,assert.h limits.h stdalign.h stdbool.h stddef.h string.h) $@

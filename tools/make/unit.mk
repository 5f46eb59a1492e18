# Unit tests: each tests/unit/test_*.c is one Unity program, linked with the whole firmware, under the address and undefined-behaviour sanitizers.
SANITIZE := -O1 -g -fno-omit-frame-pointer -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all
UNIT_TESTS = $(wildcard tests/unit/test_*.c)
# Code of a board that a unit test reaches is included by that test itself.
UNIT_FIRMWARE = $(LIBRARY_SOURCES)

$(BUILD)/unity/unity.h:
	@mkdir -p $(@D)
	@unity=$$(tools/toolbox unity); cp "$$unity"/unity*.[ch] $(@D)

$(BUILD)/unity/unity.o: $(BUILD)/unity/unity.h
	@$(CC) -std=c11 -O1 -g -c -o $@ $(@D)/unity.c

define UNIT_RULES
UNIT_OBJECTS_$(1) = $$(UNIT_FIRMWARE:%.c=$(BUILD)/object/unit-$(1)/%.o)
UNIT_PROGRAMS_$(1) = $$(UNIT_TESTS:tests/unit/%.c=$(BUILD)/unit/$(1)/%)

$(BUILD)/object/unit-$(1)/%.o: %.c tools/make/firmware.mk tools/make/unit.mk | $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1), sanitizers)'
	@$$(CC) $$(CFLAGS_ALL) $(FLAGS_$(1)) $(SANITIZE) $(LIBRARY_INCLUDES) $(STRICT) -c -o $$@ $$<

$(BUILD)/unit/$(1)/%: tests/unit/%.c $$(UNIT_OBJECTS_$(1)) $(BUILD)/unity/unity.o
	@mkdir -p $$(@D)
	@echo 'cc $$< ($(1), sanitizers)'
	@$$(CC) $$(CFLAGS_ALL) $(FLAGS_$(1)) $(SANITIZE) -MF $$@.d $(LIBRARY_INCLUDES) -Itests/unit -isystem $(BUILD)/unity \
	    -Wall -Wextra -Wshadow -Werror -o $$@ $$< $$(UNIT_OBJECTS_$(1)) $(BUILD)/unity/unity.o -lm

.PHONY: unit-programs-$(1)
unit-programs-$(1): $$(UNIT_PROGRAMS_$(1))

-include $$(UNIT_OBJECTS_$(1):.o=.d) $$(UNIT_PROGRAMS_$(1):%=%.d)
endef
$(foreach numeric,float fixed,$(eval $(call UNIT_RULES,$(numeric))))

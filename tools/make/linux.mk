# The guard as a process on SocketCAN: build/tauperp-guard, in fixed point, and under the sanitizers for its tests.
LINUX_SOURCES = $(filter-out firmware/robots/%,$(FIRMWARE_SOURCES)) $(wildcard firmware/hosts/linux/*.c)

.PHONY: guard guard-fixed guard-sanitized

guard: $(BUILD)/tauperp-guard ## build the guard as a SocketCAN process: build/tauperp-guard
guard-fixed: $(BUILD)/fixed/tauperp-guard
guard-sanitized: $(BUILD)/sanitized/tauperp-guard

# $(call LINUX_RULES,NAME,FLAGS,FOLDER)
define LINUX_RULES
LINUX_OBJECTS_$(1) = $$(LINUX_SOURCES:%.c=$(BUILD)/object/linux-$(1)/%.o)

$(BUILD)/object/linux-$(1)/%.o: %.c tools/make/firmware.mk tools/make/linux.mk | $(BUILD)/build_id.h
	@mkdir -p $$(@D)
	@echo 'cc $$< (linux, $(1))'
	@$$(CC) $$(CFLAGS_ALL) $(2) $(STRICT) -c -o $$@ $$<

$(3)/tauperp-guard: $$(LINUX_OBJECTS_$(1))
	@mkdir -p $$(@D)
	@$$(CC) $(2) -o $$@.new $$^
	@mv $$@.new $$@

-include $$(LINUX_OBJECTS_$(1):.o=.d)
endef
$(eval $(call LINUX_RULES,float,-O2,$(BUILD)))
$(eval $(call LINUX_RULES,fixed,-O2 $(FLAGS_fixed),$(BUILD)/fixed))
$(eval $(call LINUX_RULES,sanitized,$(SANITIZE),$(BUILD)/sanitized))

# What its tests and measurements drive it with: tests/bus/peer.c on a bus, tests/bus/soak*.c without one.
$(BUILD)/object/linux-float/tests/bus/%.o: CFLAGS_ALL += -Ifirmware/hosts/linux
PEER_OBJECTS = $(patsubst %.c,$(BUILD)/object/linux-float/%.o,tests/bus/peer.c firmware/hosts/linux/clock.c \
    firmware/hosts/linux/histogram.c $(wildcard firmware/wire/*.c firmware/wire/generated/*.c))
SOAK_OBJECTS = $(patsubst %.c,$(BUILD)/object/linux-float/%.o,$(wildcard tests/bus/soak*.c) \
    $(filter-out firmware/hosts/%,$(LINUX_SOURCES)))

# The example of a robot's controller (firmware/robot_side).
CONTROLLER_OBJECTS = $(patsubst %.c,$(BUILD)/object/linux-float/%.o,firmware/examples/controller/controller.c \
    firmware/robot_side/robot_side.c $(wildcard firmware/wire/*.c firmware/wire/generated/*.c))
$(BUILD)/object/linux-float/firmware/examples/%.o $(BUILD)/object/linux-float/firmware/robot_side/%.o: CFLAGS_ALL += -Ifirmware/robot_side

$(BUILD)/bus-peer: $(PEER_OBJECTS)
$(BUILD)/bus-soak: $(SOAK_OBJECTS)
$(BUILD)/controller: $(CONTROLLER_OBJECTS)
$(BUILD)/bus-peer $(BUILD)/bus-soak $(BUILD)/controller:
	@$(CC) -O2 -o $@.new $^
	@mv $@.new $@
-include $(wildcard $(BUILD)/object/linux-float/tests/bus/*.d)

.PHONY: bench-can
bench-can: guard $(BUILD)/bus-peer $(BUILD)/bus-soak library venv ## what the guard's process sustains on vcan; numbers in out/bus/bench.json
	@tools/vcan $(VENV)/bin/python tools/bench-can $(ARGUMENTS)

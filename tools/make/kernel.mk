# The kernel of `tauperp campaign`: the firmware and MuJoCo in one loop, as a shared library for each number type.
# MuJoCo's symbols are resolved when the host loads it, after MuJoCo itself; its headers come with the wheel in .venv.
KERNEL_SOURCES := $(wildcard host/kernel/*.c)
# The shell finds them: make reads a folder once, which may be before .venv is there.
MUJOCO_INCLUDE := $$(echo $(VENV)/lib/python3*/site-packages/mujoco/include)

.PHONY: kernel
kernel: venv $(foreach numeric,$(NUMERICS),$(DIR_$(numeric))/libtauperp_kernel.so) ## build the kernel of `tauperp campaign`

define KERNEL_RULES
KERNEL_OBJECTS_$(1) = $$(KERNEL_SOURCES:%.c=$(BUILD)/object/library-$(1)/%.o)
$$(KERNEL_OBJECTS_$(1)): CFLAGS_ALL += -Ihost/kernel -isystem $$(MUJOCO_INCLUDE)
$$(KERNEL_OBJECTS_$(1)): | $(VENV_STAMP)

$(DIR_$(1))/libtauperp_kernel.so: $$(KERNEL_OBJECTS_$(1)) $$(LIBRARY_OBJECTS_$(1))
	@mkdir -p $$(@D)
	@$$(CC) -shared -Wl,-Bsymbolic -o $$@.new $$^ -lm
	@mv $$@.new $$@

-include $$(KERNEL_OBJECTS_$(1):.o=.d)
endef
$(foreach numeric,float fixed,$(eval $(call KERNEL_RULES,$(numeric))))

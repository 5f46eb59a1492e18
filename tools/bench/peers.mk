# The peers of the bench (tools/bench/peer.h): our counting programs, in which a peer's function stands for motion_step
# or index_step. The rest is the same object files.
PEER_PROJECTIONS := svd qr
PEER_PROGRAMS := stages guard
# -O3 is the better for them everywhere; on the M4F, where figures are most often told, -O2 as well.
PEER_LEVELS_m4f := -O2 -O3
$(foreach target,$(filter-out m4f,$(BENCH_ALL)),$(eval PEER_LEVELS_$(target) := -O3))
# MOTION_PROJECTION; of Pinocchio only the cheaper one, since the projection is the same again
PEERS_host := casadi_svd casadi_qr pinocchio_qr
$(foreach target,$(TARGETS),$(eval PEERS_$(target) := casadi_svd casadi_qr))

PEER_DIR := $(BUILD)/bench/peer
PEER_FLAGS := -fno-math-errno -ffunction-sections -fdata-sections -DNDEBUG -Itools/bench -I$(PEER_DIR) -I$(SUPPORT)
# A peer may contract products and sums: -ffp-contract=off is our own wish, and Eigen is used without exceptions.
PEER_CFLAGS = -std=c11 $(PEER_FLAGS) $(INCLUDES) -DROBOT_JOINTS=$(BENCH_JOINTS)u -Wall -Wno-unused-parameter -Wdouble-promotion -Werror -MMD -MP
PEER_CXXFLAGS := -std=c++17 $(PEER_FLAGS) -isystem /usr/include/eigen3 -Wall -Wno-unused-parameter -Wdouble-promotion -Werror -MMD -MP
PEER_ONLY_TARGET := -fno-exceptions -fno-rtti -fno-threadsafe-statics
PINOCCHIO := $(VENV)/lib/python3*/site-packages/cmeel.prefix/include
PEER_CXXFLAGS_pinocchio = -isystem $$(echo $(PINOCCHIO)) -DBOOST_MPL_LIMIT_LIST_SIZE=30 -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
PEER_CXX_host = $(CXX) -fno-pie
$(foreach target,$(TARGETS),$(eval PEER_CXX_$(target) = $(CROSS)g++ $(CPU_$(target)) $(PEER_ONLY_TARGET)))

# CasADi is for this alone, and not among what the host package needs.
CASADI_STAMP = $(VENV_STAMP)-casadi
$(CASADI_STAMP): $(VENV_STAMP) pyproject.toml
	@$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock --editable '.[bench]'
	@touch $@

$(PEER_DIR)/casadi_terms.c: tools/bench/peer_terms.py $(CASADI_STAMP)
	@mkdir -p $(@D)
	@$(VENV)/bin/python $< casadi $(BENCH_ROBOT) $@

$(PEER_DIR)/pinocchio_model.h: tools/bench/peer_terms.py $(CASADI_STAMP)
	@mkdir -p $(@D)
	@$(VENV)/bin/python $< pinocchio $(BENCH_ROBOT) $@

# build/bench/peer/TARGET-O2/NAME.o; a double that slipped in is a call of a helper on a core without them
no_doubles = ! $(BENCH_OBJCOPY_$(1):objcopy=nm) $@ | grep __aeabi_d
define PEER_OBJECT_RULES
$(PEER_DIR)/$(1)$(2)/peer_eigen.o: tools/bench/peer_eigen.cpp tools/bench/peers.mk
	@mkdir -p $$(@D)
	@$$(PEER_CXX_$(1)) $(2) $$(PEER_CXXFLAGS) -c -o $$@ $$<
	@$$(call no_doubles,$(1))

$(PEER_DIR)/$(1)$(2)/peer_casadi.o: tools/bench/peer_casadi.c $(PEER_DIR)/casadi_terms.c tools/bench/peers.mk
	@mkdir -p $$(@D)
	@$$(BENCH_CC_$(1)) $(2) $(if $(filter host,$(1)),-fno-pie) $$(PEER_CFLAGS) -c -o $$@ $$<
	@$$(call no_doubles,$(1))

$(PEER_DIR)/$(1)$(2)/%.o: tools/bench/%.c tools/bench/peers.mk
	@mkdir -p $$(@D)
	@$$(BENCH_CC_$(1)) $(2) $(if $(filter host,$(1)),-fno-pie) $$(PEER_CFLAGS) $$(PEER_CFLAGS_$(1)$(2)) -c -o $$@ $$<

-include $(addprefix $(PEER_DIR)/$(1)$(2)/,peer_eigen.d peer_casadi.d peer_index.d agree.d)
endef
PEER_CFLAGS_host-O3 := -DPEER_PINOCCHIO
$(foreach target,$(BENCH_ALL),$(foreach level,$(PEER_LEVELS_$(target)),$(eval $(call PEER_OBJECT_RULES,$(target),$(level)))))

$(PEER_DIR)/host-O3/peer_pinocchio.o: tools/bench/peer_pinocchio.cpp $(PEER_DIR)/pinocchio_model.h tools/bench/peers.mk
	@mkdir -p $(@D)
	@echo 'c++ $<'
	@$(PEER_CXX_host) -O3 $(PEER_CXXFLAGS) $(PEER_CXXFLAGS_pinocchio) -c -o $@ $<
-include $(PEER_DIR)/host-O3/peer_pinocchio.d

# $(call peer_image,TARGET,NAME,PROGRAM), NAME: MOTION_PROJECTION-LEVEL; the object files of ours that go with it: the
# host's memcpy is the C library's, which is faster than our loop
peer_image = $(BUILD)/bench/$(1)-$(2)-$(3).elf
peer_ours = $(filter-out $(if $(filter host,$(1)),%/memory.o),$(call bench_objects,$(1),float,$(2)))
# the MOTION and the PROJECTION of a name
peer_motion = $(word 1,$(subst _, ,$(1)))
peer_projection = $(word 2,$(subst _, ,$(1)))
# $(call peer_files,TARGET,LEVEL,MOTION...)
peer_files = $(addprefix $(PEER_DIR)/$(1)$(2)/,$(3:%=peer_%.o) peer_eigen.o peer_index.o)
peer_link = $(call bench_link,$(1),float) -o $$@ $(2) $(BENCH_LIBRARIES_$(1)) $(PEER_LIBRARIES_$(1))
# Names bound before main: or the first state would pay for it.
PEER_LIBRARIES_host := -Wl,-z,now -lstdc++ -lm

# $(call PEER_RULES,TARGET,MOTION_PROJECTION,LEVEL,PROGRAM)
define PEER_RULES
$(call peer_image,$(1),$(2)$(3),$(4)): $(call peer_ours,$(1),$(4)) $(call peer_files,$(1),$(3),$(call peer_motion,$(2))) \
    $(call bench_parts,$(1),float) tools/bench/peers.mk
	@echo 'ld $$@'
	@for object in $(call peer_ours,$(1),$(4)); do \
	    copy=$(PEER_DIR)/$(1)-$(2)$(3)-$(4)/$$$$object; mkdir -p "$$$${copy%/*}"; \
	    case $$$$object in \
	        */firmware/core/*) cp $$$$object $$$$copy;; \
	        *) $(BENCH_OBJCOPY_$(1)) --redefine-sym motion_step=peer_$(call peer_motion,$(2))_motion_step \
	            --redefine-sym index_step=peer_$(call peer_projection,$(2))_index_step $$$$object $$$$copy;; \
	    esac; done
	@$(call peer_link,$(1),$(addprefix $(PEER_DIR)/$(1)-$(2)$(3)-$(4)/,$(call peer_ours,$(1),$(4))) \
	    $(call peer_files,$(1),$(3),$(call peer_motion,$(2))))
endef
$(foreach target,$(BENCH_ALL),$(foreach peer,$(PEERS_$(target)),$(foreach level,$(PEER_LEVELS_$(target)),\
    $(foreach program,$(PEER_PROGRAMS),$(eval $(call PEER_RULES,$(target),$(peer),$(level),$(program)))))))

# $(call AGREE_RULES,TARGET,LEVEL): ours and all peers of a level in one program
agree_ours = $(call bench_object,$(1),float,\
    $(BENCH_FIRMWARE_stages) $(filter-out %/memory.c,$(BENCH_SOURCES)) $(BENCH_SOURCES_$(HOME_$(1))))
agree_theirs = $(call peer_files,$(1),$(2),$(sort $(foreach peer,$(PEERS_$(1)),$(call peer_motion,$(peer)))))
define AGREE_RULES
$(call peer_image,$(1),peers$(2),agree): $(call agree_ours,$(1)) $(call agree_theirs,$(1),$(2)) \
    $(PEER_DIR)/$(1)$(2)/agree.o $(call bench_parts,$(1),float) tools/bench/peers.mk
	@echo 'ld $$@'
	@$(call peer_link,$(1),$$(filter %.o,$$^))
endef
$(foreach target,$(BENCH_ALL),$(foreach level,$(PEER_LEVELS_$(target)),$(eval $(call AGREE_RULES,$(target),$(level)))))

# $(call peer_images,TARGETS), and as arguments of bench.py: TARGET:NAME
peer_names = $(foreach level,$(PEER_LEVELS_$(1)),$(PEERS_$(1):%=%$(level)))
peer_runs = $(foreach target,$(1),$(addprefix $(target):,$(call peer_names,$(target))))
peer_images = $(foreach target,$(1),$(foreach level,$(PEER_LEVELS_$(target)),$(call peer_image,$(target),peers$(level),agree)) \
    $(foreach name,$(call peer_names,$(target)),$(foreach program,$(PEER_PROGRAMS),$(call peer_image,$(target),$(name),$(program)))))

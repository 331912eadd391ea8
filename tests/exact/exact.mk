# The exact scene (tests/exact): one program, linked with each of the two implementations of renderer/scene.
EXACT_LIBS = $(L)renderer.a $(L)geometry.a $(L)base.a
EXACT_SCENE := $(patsubst %.c,$(BUILD)/obj/%.c.o,$(wildcard tests/exact/exact_*.c tests/exact/capsule*.c tests/exact/tube*.c))
EXACT_BINS := $(BUILD)/tests/exact/cloth_blocks $(BUILD)/tests/exact/cloth_blocks_exact
$(BUILD)/tests/exact/cloth_blocks: $(BUILD)/obj/tests/exact/cloth_blocks_main.c.o $(EXACT_LIBS)
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(TEST_LINKER) $(LDFLAGS) -o $@ $^ -ljansson $(LINK_RENDERER)
# its objects come before the library, whose own scene is then left out: a name that is in both would not link
$(BUILD)/tests/exact/cloth_blocks_exact: $(BUILD)/obj/tests/exact/cloth_blocks_main.c.o $(EXACT_SCENE) $(EXACT_LIBS)
	@mkdir -p $(@D)
	@echo "  LINK $@"
	@$(CC) $(TEST_LINKER) $(LDFLAGS) -o $@ $^ -ljansson $(LINK_RENDERER)
$(BUILD)/tests/physics/exact/test_capsule: $(patsubst %,$(BUILD)/obj/tests/exact/%.c.o,capsule capsule_cloth capsule_walk tube_links)
$(BUILD)/tests/physics/exact/test_scene_rays: $(patsubst %,$(BUILD)/obj/tests/exact/%.c.o,capsule capsule_cloth capsule_walk tube_links)

# The extension in a running Godot without a window: classes, sound in Godot's mixer, sides, a room, a panel that moves, what is left
# behind. Prints a line for each question and exits with 1 if one fails.
extends SceneTree

const RATE_HZ := 44100
# Parent of each class, and the properties that a scene file may have.
const CLASSES := {
	"ForesoundEngine": ["Node", ["source_slots", "max_sources", "bus", "max_drawn_paths"]],
	"ForesoundListener3D": ["Node3D", []],
	"ForesoundSource3D": ["Node3D", ["stream", "autoplay", "looped", "paused", "gain", "pitch", "without_position"]],
	"ForesoundGeometry": ["Node3D", ["material"]],
	"ForesoundInstance": ["Node3D", ["material"]],
	"ForesoundMaterial": ["Resource", ["library_name", "absorption", "scattering", "transmission"]],
}

var capture := AudioEffectCapture.new()
var failed := 0


func check(what: String, holds: bool, found) -> void:
	print("%s %s (%s)" % ["ok  " if holds else "FAIL", what, found])
	failed += 0 if holds else 1


func noise() -> AudioStreamWAV:
	var bytes := PackedByteArray()
	bytes.resize(2 * RATE_HZ)
	var state := 1
	for at in RATE_HZ:
		state = (state * 1664525 + 1013904223) & 0xffffffff
		bytes.encode_s16(2 * at, ((state >> 16) - 32768) / 5)
	var wave := AudioStreamWAV.new()
	wave.format = AudioStreamWAV.FORMAT_16_BITS
	wave.mix_rate = RATE_HZ
	wave.data = bytes
	return wave


func mesh(size: Vector3) -> MeshInstance3D:
	var shape := BoxMesh.new()
	shape.size = size
	var node := MeshInstance3D.new()
	node.mesh = shape
	return node


func named(library_name: String) -> Resource:
	var material = ClassDB.instantiate("ForesoundMaterial")
	material.library_name = library_name
	return material


func wait_s(seconds: float) -> void:
	await create_timer(seconds).timeout


# Until what has moved is heard: the scene is committed, and updated thrice. A machine with little time to spare takes seconds.
func settle(engine: Node) -> void:
	await process_frame
	await process_frame
	while engine.is_building():
		await process_frame
	var first: int = engine.update_count()
	for turn in 200:
		if engine.update_count() > first + 2:
			return
		await wait_s(0.1)
	check("updates go on", false, engine.update_count() - first)


# Energy of the left and the right ear, of what Godot's mixer plays in a second.
func listen() -> Vector2:
	# What the mixer still holds.
	await wait_s(0.5)
	capture.clear_buffer()
	await wait_s(1.0)
	var energy := Vector2.ZERO
	for frame in capture.get_buffer(capture.get_frames_available()):
		energy += frame * frame
	return energy


func _initialize() -> void:
	await run()
	print("%d failed" % failed)
	quit(1 if failed > 0 else 0)


func classes() -> void:
	for name in CLASSES:
		var expected: Array = CLASSES[name]
		var own: Array[String] = []
		for property in ClassDB.class_get_property_list(name, true):
			if property.usage & PROPERTY_USAGE_STORAGE:
				own.append(property.name)
		var is_so: bool = ClassDB.get_parent_class(name) == expected[0] and own == Array(expected[1], TYPE_STRING, "", null)
		check("class %s" % name, is_so, own)


func run() -> void:
	classes()
	AudioServer.add_bus_effect(0, capture)
	capture.buffer_length = 4.0
	await process_frame
	var before := int(Performance.get_monitor(Performance.OBJECT_COUNT))
	await sounds()
	var first = load("res://first_sound.gd").new()
	root.add_child(first)
	await wait_s(1.0)
	var heard: Vector2 = await listen()
	check("the first sound of the guide sounds", heard.x > 0.0 and heard.y > 0.0, heard)
	first.free()
	# What is freed at the end of a frame, and the mixer's stopped playbacks.
	await wait_s(0.5)
	var objects := int(Performance.get_monitor(Performance.OBJECT_COUNT))
	for turn in 20:
		var engine = ClassDB.instantiate("ForesoundEngine")
		root.add_child(engine)
		await process_frame
		engine.free()
	await wait_s(0.5)
	var left := int(Performance.get_monitor(Performance.OBJECT_COUNT)) - objects
	check("20 engines leave no objects", left <= 0, "%d; %d after the first" % [left, objects - before])


func sounds() -> void:
	var engine = ClassDB.instantiate("ForesoundEngine")
	engine.max_drawn_paths = 64
	var ears = ClassDB.instantiate("ForesoundListener3D")
	var source = ClassDB.instantiate("ForesoundSource3D")
	source.stream = noise()
	source.looped = true
	source.position = Vector3(2, 0, 0)
	for node in [engine, ears, source]:
		root.add_child(node)
	await settle(engine)
	var right: Vector2 = await listen()
	check("a source to the right is louder there", right.y > 1.5 * right.x and right.x > 0.0, right)
	check("open air has one path", engine.path_count() == 1, engine.path_count())
	source.position = Vector3(-2, 0, 0)
	await settle(engine)
	var left: Vector2 = await listen()
	check("and to the left there", left.x > 1.5 * left.y and left.y > 0.0, left)
	# 6 m by 6 m, halfway: 3.2 m around its edges. Maekawa's chart has 14 dB at 63 Hz and more above.
	var panel = ClassDB.instantiate("ForesoundInstance")
	panel.material = named("concrete")
	panel.add_child(mesh(Vector3(0.1, 6, 6)))
	panel.position = Vector3(-1, 0, 0)
	root.add_child(panel)
	await settle(engine)
	var behind: Vector2 = await listen()
	var loss_db := 10.0 * log((left.x + left.y) / (behind.x + behind.y)) / log(10.0)
	check("a panel between takes away 6 dB or more", loss_db > 6.0, "%.1f dB" % loss_db)
	panel.position = Vector3(30, 0, 0)
	await settle(engine)
	var moved: Vector2 = await listen()
	var change_db: float = 10.0 * absf(log((left.x + left.y) / (moved.x + moved.y))) / log(10.0)
	check("nothing, once it has moved away", change_db < 1.0, "%.2f dB" % change_db)
	await room(engine, source, ears)
	for node in [panel, source, ears, engine]:
		node.free()


func room(engine: Node, source: Node3D, ears: Node3D) -> void:
	var walls = ClassDB.instantiate("ForesoundGeometry")
	walls.material = named("concrete")
	walls.add_child(mesh(Vector3(8, 3, 6)))
	root.add_child(walls)
	await settle(engine)
	check("a room has more than its six walls' paths", engine.path_count() > 7, engine.path_count())
	check("an update takes time", engine.update_ms() > 0.0, "%.2f ms" % engine.update_ms())
	var ends := 0
	var drawn: Array = engine.drawn_paths()
	for path in drawn:
		if path[0].is_equal_approx(source.position) and path[path.size() - 1].is_equal_approx(ears.position):
			ends += 1
	check("drawn paths lead from the source to the ears", ends > 7 and ends == drawn.size(), ends)
	engine.set_paused(true)
	var paused: Vector2 = await listen()
	check("a paused engine is silent", paused == Vector2.ZERO, paused)
	engine.set_paused(false)
	root.remove_child(engine)
	var gone: Vector2 = await listen()
	check("an engine outside the tree is silent", gone == Vector2.ZERO, gone)
	root.add_child(engine)
	await settle(engine)
	var back: Vector2 = await listen()
	check("and sounds when it is back", back.x > 0.0 and back.y > 0.0, back)
	source.stop()
	walls.free()

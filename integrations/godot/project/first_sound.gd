extends Node3D


func _ready():
	add_child(ForesoundEngine.new())
	# The ears: below the camera.
	var ears = ForesoundListener3D.new()
	add_child(ears)
	# The walls: all meshes at and below the node.
	var walls = ForesoundGeometry.new()
	walls.material = ForesoundMaterial.new()
	walls.material.library_name = "concrete"
	var room = MeshInstance3D.new()
	room.mesh = BoxMesh.new()
	room.mesh.size = Vector3(8, 3, 6)
	walls.add_child(room)
	add_child(walls)
	# What sounds: a WAV file that is imported with the compress mode PCM.
	var voice = ForesoundSource3D.new()
	voice.stream = load("res://voice.wav")
	voice.looped = true
	voice.position = Vector3(2, 0, -1)
	add_child(voice)

// The part of Gradle's and the Android plugin's language that our build scripts use. Neither is available on the build
// machines: this checks the scripts' syntax, the types declared here, the version catalog's names, and runs the scripts
// to inspect the cargo command they make. It does not test Gradle itself.
@file:Suppress("UNUSED_PARAMETER", "unused", "PropertyName")

import java.io.File

class Value<T>(private val value: T) {
    fun get(): T = value
}

class Plugin(val id: String, val version: String)

class PluginUse {
    infix fun apply(now: Boolean) = Unit
}

class Plugins {
    fun alias(plugin: Value<Plugin>) = PluginUse()
    val `maven-publish` = PluginUse()
}

fun plugins(block: Plugins.() -> Unit) = Plugins().block()

object repositories {
    fun google() = Unit
    fun mavenCentral() = Unit
    fun gradlePluginPortal() = Unit
}

enum class RepositoriesMode { FAIL_ON_PROJECT_REPOS }

class Management {
    var repositoriesMode: RepositoriesMode? = null
    fun repositories(block: repositories.() -> Unit) = repositories.block()
}

fun pluginManagement(block: Management.() -> Unit) = Management().block()

fun dependencyResolutionManagement(block: Management.() -> Unit) = Management().block()

class Project {
    var name = ""
}

val rootProject = Project()

fun include(vararg names: String) = names.forEach { check(File("android", it.trimStart(':')).isDirectory) { "no $it" } }

val rootDir: File = File("android").absoluteFile

class Sources(val folder: File) {
    val patterns = mutableListOf<String>()
    fun include(vararg names: String) = patterns.addAll(names)
}

fun fileTree(folder: File, block: Sources.() -> Unit) = Sources(folder).apply(block)

var group: Any = ""
var version: Any = ""
val projectDir: File = File("android/foresound").absoluteFile

class Folders(private val folder: File) {
    fun dir(name: String) = Value(AsFile(folder.resolve(name)))
}

class Layout {
    val buildDirectory = Folders(projectDir.resolve("build"))
}

val layout = Layout()

class Inputs {
    fun files(vararg what: Any) = Unit
}

class Outputs {
    val folders = mutableListOf<File>()
    fun dir(folder: File) = folders.add(folder)
}

open class Task {
    var name = ""
    var description = ""
    fun dependsOn(task: Any) = Unit
}

/** What goes into an archive: files or a folder, and the folder inside that takes it. */
class Copied(val what: File) {
    var into = ""
    fun into(folder: String) {
        into = folder
    }
}

class Zip : Task() {
    val copied = mutableListOf<Copied>()
    fun from(what: File, block: Copied.() -> Unit) = copied.add(Copied(what).apply(block))
}

val zips = listOf(Zip().apply { name = "bundleReleaseAar" }, Zip().apply { name = "sourcesJar" })

class Matching(private val all: List<Zip>) {
    fun configureEach(block: Zip.() -> Unit) = all.forEach(block)
}

class Exec : Task() {
    var workingDir = File("")
    val inputs = Inputs()
    val outputs = Outputs()
    var command: List<String> = emptyList()
    fun environment(name: String, value: Any) = Unit
    fun commandLine(words: List<String>) {
        command = words
    }
}

class Registering<T>(val task: T) {
    operator fun provideDelegate(owner: Any?, property: kotlin.reflect.KProperty<*>) = this
    operator fun getValue(owner: Any?, property: kotlin.reflect.KProperty<*>) = task
}

val executed = mutableListOf<Exec>()

object tasks {
    fun registering(type: kotlin.reflect.KClass<Exec>, block: Exec.() -> Unit) =
        Registering(Exec().apply(block).also { executed += it })
    fun named(name: String, block: Task.() -> Unit) = Task().block()
    inline fun <reified T : Task> withType() = Matching(zips).also { check(T::class == Zip::class) }
}

class AsFile(val asFile: File)

class SdkComponents {
    val ndkDirectory = Value(AsFile(File("ndk")))
}

object androidComponents {
    val sdkComponents = SdkComponents()
}

class Ndk {
    val abiFilters = mutableSetOf<String>()
}

class DefaultConfig {
    var minSdk: Int? = null
    var targetSdk: Int? = null
    var versionCode: Int? = null
    var versionName: String? = null
    var applicationId: String? = null
    val ndk = Ndk()
    fun consumerProguardFiles(vararg files: String) =
        files.forEach { check(File("android/foresound", it).isFile) { "no $it" } }
    fun ndk(block: Ndk.() -> Unit) = ndk.block()
}

class JniLibs {
    var useLegacyPackaging = true
}

class Packaging {
    val jniLibs = JniLibs()
}

class Variant {
    fun withSourcesJar() = classifiers.add("sources")
    fun withJavadocJar() = classifiers.add("javadoc")
}

val classifiers = mutableListOf<String>()

class Publishing {
    fun singleVariant(name: String, block: Variant.() -> Unit) = Variant().block()
}

enum class JavaVersion { VERSION_17 }

class CompileOptions {
    var sourceCompatibility: JavaVersion? = null
    var targetCompatibility: JavaVersion? = null
}

class SigningConfig

class Named<T>(private val one: T) {
    fun getByName(name: String) = one
}

class BuildType {
    var isMinifyEnabled = false
    var signingConfig: SigningConfig? = null
}

class BuildTypes {
    fun release(block: BuildType.() -> Unit) = BuildType().block()
}

class AssetFolders {
    fun srcDirs(vararg folders: Any) = folders.forEach { check((it as File).isDirectory) { "no $it" } }
}

class SourceSet {
    val assets = AssetFolders()
}

class Android {
    var namespace: String? = null
    var compileSdk: Int? = null
    var ndkVersion: String? = null
    val packaging = Packaging()
    val signingConfigs = Named(SigningConfig())
    val sourceSets = Named(SourceSet())
    val config = DefaultConfig()
    fun defaultConfig(block: DefaultConfig.() -> Unit) = config.block()
    fun packaging(block: Packaging.() -> Unit) = packaging.block()
    fun publishing(block: Publishing.() -> Unit) = Publishing().block()
    fun compileOptions(block: CompileOptions.() -> Unit) = CompileOptions().block()
    fun buildTypes(block: BuildTypes.() -> Unit) = BuildTypes().block()
}

val android = Android()

fun android(block: Android.() -> Unit) = Android().run {
    block()
    check(namespace != null && compileSdk != null && config.minSdk != null)
}

/** Coordinates of dependencies and their scope in a POM, of all modules. */
val scopes = mutableListOf<Pair<String, String>>()

class Dependencies {
    fun api(what: Any) = scopes.add(what.toString() to "compile")
    fun implementation(what: Any) = scopes.add(what.toString() to "runtime")
    fun project(path: String) = path
}

fun dependencies(block: Dependencies.() -> Unit) = Dependencies().block()

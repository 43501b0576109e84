// The part of Gradle's maven-publish that foresound/build.gradle.kts uses; see StandIns.kt. It writes the POM that the values
// make, by Gradle's own rules: scope `compile` for api, `runtime` for implementation.
@file:Suppress("UNUSED_PARAMETER", "unused")

import java.io.File
import java.net.URI

class License {
    var name = ""
    var url = ""
}

class Licenses {
    val all = mutableListOf<License>()
    fun license(block: License.() -> Unit) = all.add(License().apply(block))
}

class Developer {
    var name = ""
}

class Developers {
    val all = mutableListOf<Developer>()
    fun developer(block: Developer.() -> Unit) = all.add(Developer().apply(block))
}

class Scm {
    var url = ""
}

class Pom {
    var name = ""
    var description = ""
    var url = ""
    val licenses = Licenses()
    val developers = Developers()
    val scm = Scm()
    fun licenses(block: Licenses.() -> Unit) = licenses.block()
    fun developers(block: Developers.() -> Unit) = developers.block()
    fun scm(block: Scm.() -> Unit) = scm.block()
}

class Component(val name: String)

class Components(private val all: Map<String, Component>) {
    operator fun get(name: String) = all.getValue(name)
}

val components = Components(mapOf("release" to Component("release")))

open class MavenPublication {
    var artifactId = ""
    val pom = Pom()
    var component: Component? = null
    fun from(what: Component) {
        component = what
    }
    fun pom(block: Pom.() -> Unit) = pom.block()
}

fun afterEvaluate(block: () -> Unit) = block()

val published = mutableListOf<MavenPublication>()

class Publications {
    inline fun <reified T : MavenPublication> register(name: String, block: MavenPublication.() -> Unit) =
        published.add(MavenPublication().apply(block))
}

class MavenFolder {
    var name = ""
    var url: URI? = null
}

class PublishRepositories {
    fun maven(block: MavenFolder.() -> Unit) = check(MavenFolder().apply(block).url != null)
}

class PublishingExtension {
    fun publications(block: Publications.() -> Unit) = Publications().block()
    fun repositories(block: PublishRepositories.() -> Unit) = PublishRepositories().block()
}

fun publishing(block: PublishingExtension.() -> Unit) = PublishingExtension().block()

private fun element(name: String, text: String) =
    "<$name>${text.replace("&", "&amp;").replace("<", "&lt;")}</$name>"

/** The POM of the one publication, with these dependencies. */
fun pom(dependencies: List<Pair<String, String>>): String {
    val one = published.single()
    checkNotNull(one.component)
    val head = listOf("groupId" to group.toString(), "artifactId" to one.artifactId, "version" to version.toString(),
        "packaging" to "aar", "name" to one.pom.name, "description" to one.pom.description, "url" to one.pom.url)
    return buildString {
        append("<project><modelVersion>4.0.0</modelVersion>")
        for ((name, text) in head) append(element(name, text))
        append("<licenses>")
        for (it in one.pom.licenses.all) append("<license>${element("name", it.name)}${element("url", it.url)}</license>")
        append("</licenses><developers>")
        for (it in one.pom.developers.all) append("<developer>${element("name", it.name)}</developer>")
        append("</developers><scm>${element("url", one.pom.scm.url)}</scm><dependencies>")
        for ((what, scope) in dependencies) {
            val (of, name, number) = what.split(':')
            append("<dependency>${element("groupId", of)}${element("artifactId", name)}${element("version", number)}")
            append("${element("scope", scope)}</dependency>")
        }
        append("</dependencies></project>\n")
    }
}

/** Writes what the scripts say: the POM and, a line each, what goes into the AAR and which jars stand beside it. */
fun writePublication(folder: File, dependencies: List<Pair<String, String>>) {
    folder.mkdirs()
    folder.resolve("pom.xml").writeText(pom(dependencies))
    val lines = zips.first().copied.map { "aar ${it.into} ${it.what}" } + classifiers.map { "jar $it" }
    folder.resolve("layout.txt").writeText(lines.joinToString("\n", postfix = "\n"))
}

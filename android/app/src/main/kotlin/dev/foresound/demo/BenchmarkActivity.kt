package dev.foresound.demo

import android.app.Activity
import android.content.Intent
import android.graphics.Typeface
import android.os.Build
import android.os.Bundle
import android.util.Log
import android.view.MotionEvent
import android.view.WindowManager
import android.widget.Button
import android.widget.LinearLayout
import android.widget.ScrollView
import android.widget.TextView
import dev.foresound.Clip
import dev.foresound.Scene
import dev.foresound.UnavailableException
import java.io.File
import java.io.IOException
import java.util.concurrent.atomic.AtomicInteger
import kotlinx.coroutines.CoroutineScope
import kotlinx.coroutines.Dispatchers
import kotlinx.coroutines.SupervisorJob
import kotlinx.coroutines.cancel
import kotlinx.coroutines.launch
import kotlinx.coroutines.withContext

/**
 * The cells of Table 4: both schedules, threads pinned and not, screen touched and not. Shows the table beside the
 * paper's and writes JSON, to be shared and in `benchmark.json` of the app's external folder, where adb can read it. Extras: `seconds` a schedule and cell, `passes` the
 * number of the four passes to run (the first two need no touch).
 */
class BenchmarkActivity : Activity() {
    private val scope = CoroutineScope(SupervisorJob() + Dispatchers.Main)
    private val touches = AtomicInteger()
    private lateinit var heading: TextView
    private lateinit var body: TextView
    private var result = ""

    override fun onCreate(state: Bundle?) {
        super.onCreate(state)
        window.addFlags(WindowManager.LayoutParams.FLAG_KEEP_SCREEN_ON)
        heading = TextView(this)
        body = TextView(this)
        body.typeface = Typeface.MONOSPACE
        body.textSize = 9f
        val share = Button(this)
        share.text = "share"
        share.setOnClickListener { share() }
        val scroll = ScrollView(this)
        scroll.addView(body)
        val column = LinearLayout(this)
        column.orientation = LinearLayout.VERTICAL
        column.addView(share)
        column.addView(heading)
        column.addView(scroll)
        setContentView(column)
        scope.launch {
            try {
                run()
            } catch (missing: IOException) {
                heading.text = missing.message
            } catch (missing: UnavailableException) {
                heading.text = missing.message
            }
        }
    }

    private suspend fun run() {
        val seconds = intent.getFloatExtra("seconds", 2f).toDouble().coerceIn(0.1, 60.0)
        val passes = Pass.ALL.take(intent.getIntExtra("passes", Pass.ALL.size).coerceIn(1, Pass.ALL.size))
        val table = paperTable(withContext(Dispatchers.IO) { read("paper_table_4.csv") })
        val benchmark = Benchmark(seconds) { touches.get() }
        val rows = mutableListOf<Row>()
        for (pass in passes) {
            for ((name, cells) in table.groupBy { it.scene }) {
                heading.text = "$pass: $name" + if (pass.touched) "; keep a finger moving here" else "; hands off"
                val layout = SceneLayout(withContext(Dispatchers.IO) { read("$name.toml") })
                Scene.fromAsset(this, "$name.obj").use { scene ->
                    Clip.fromAsset(this, "voice01.wav", Benchmark.RATE_HZ).use { clip ->
                        for (cell in cells) {
                            rows += withContext(Dispatchers.Default) { benchmark.row(Stage(scene, layout, clip), cell, pass) }
                            body.text = table(rows)
                        }
                    }
                }
                result = json("${Build.MANUFACTURER} ${Build.MODEL}, API ${Build.VERSION.SDK_INT}", seconds, rows)
                withContext(Dispatchers.IO) { File(getExternalFilesDir(null) ?: filesDir, "benchmark.json").writeText(result) }
            }
        }
        heading.text = "done: ${rows.size} cells"
        Log.i("foresound", "benchmark done")
    }

    private fun read(name: String) = assets.open(name).use { it.reader().readText() }

    private fun share() {
        val send = Intent(Intent.ACTION_SEND)
        send.type = "application/json"
        send.putExtra(Intent.EXTRA_TEXT, result)
        startActivity(Intent.createChooser(send, "benchmark"))
    }

    override fun dispatchTouchEvent(event: MotionEvent): Boolean {
        touches.incrementAndGet()
        return super.dispatchTouchEvent(event)
    }

    override fun onDestroy() {
        scope.cancel()
        super.onDestroy()
    }
}
